//! Network management: the states of a node and the commands that change them (CiA 301, 7.3.2).

use crate::NodeId;

/// The NMT state. The discriminant is the code of the state in a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum State {
    /// Before boot-up: only LSS works. The code is the content of the boot-up message.
    Initialising = 0x00,
    /// Error control and NMT only. LSS works in every state.
    Stopped = 0x04,
    /// All services and PDOs.
    Operational = 0x05,
    /// All services, no PDOs.
    PreOperational = 0x7F,
}

impl State {
    /// Whether SDO, SYNC and EMCY exist in this state (CiA 301, table 38).
    #[must_use]
    pub const fn has_services(self) -> bool {
        !matches!(self, State::Initialising | State::Stopped)
    }

    /// Whether PDOs exist in this state.
    #[must_use]
    pub const fn has_pdos(self) -> bool {
        matches!(self, State::Operational)
    }

    /// The code in a heartbeat.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The state of a code; `None` for a code that CiA 301, 7.2.8.3.2.2 reserves.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<State> {
        match code {
            0x00 => Some(State::Initialising),
            0x04 => Some(State::Stopped),
            0x05 => Some(State::Operational),
            0x7F => Some(State::PreOperational),
            _ => None,
        }
    }
}

/// A command of the NMT master. The discriminant is the command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Command {
    /// Go to Operational.
    Start = 0x01,
    /// Go to Stopped.
    Stop = 0x02,
    /// Go to Pre-operational.
    EnterPreOperational = 0x80,
    /// Restart the whole node.
    ResetNode = 0x81,
    /// Restart communication.
    ResetCommunication = 0x82,
}

impl Command {
    /// All commands.
    pub const ALL: [Command; 5] = [
        Command::Start,
        Command::Stop,
        Command::EnterPreOperational,
        Command::ResetNode,
        Command::ResetCommunication,
    ];

    /// The command in a frame with CAN-ID 0. `None` unless the frame addresses node `own` or all nodes (node-ID 0).
    #[must_use]
    pub fn parse(data: &[u8], own: NodeId) -> Option<Command> {
        let &[specifier, node] = data else { return None };
        if node != 0 && node != own.get() {
            return None;
        }
        Command::from_specifier(specifier)
    }

    /// The command with a specifier; `None` for a reserved one.
    #[must_use]
    pub const fn from_specifier(specifier: u8) -> Option<Command> {
        Some(match specifier {
            0x01 => Command::Start,
            0x02 => Command::Stop,
            0x80 => Command::EnterPreOperational,
            0x81 => Command::ResetNode,
            0x82 => Command::ResetCommunication,
            _ => return None,
        })
    }

    /// The data of the frame, for one node, or for all nodes with `None`.
    #[must_use]
    pub fn encode(self, node: Option<NodeId>) -> [u8; 2] {
        [self as u8, node.map_or(0, NodeId::get)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_for_one_node_or_for_all() {
        let (own, other) = (NodeId::new(5).unwrap(), NodeId::new(6).unwrap());
        for command in Command::ALL {
            assert_eq!(Command::parse(&command.encode(Some(own)), own), Some(command));
            assert_eq!(Command::parse(&command.encode(None), own), Some(command));
            assert_eq!(Command::parse(&command.encode(Some(other)), own), None);
        }
    }

    #[test]
    fn two_bytes_and_a_known_specifier_make_a_command() {
        let own = NodeId::new(5).unwrap();
        assert_eq!(Command::parse(&[1], own), None);
        assert_eq!(Command::parse(&[1, 5, 0], own), None);
        assert_eq!(Command::parse(&[3, 5], own), None);
    }
}
