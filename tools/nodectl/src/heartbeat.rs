//! Heartbeats and boot-up messages (CiA 301, 7.2.8.2.2 and 7.2.8.3.2) as the master hears them.

use canopen::nmt::State;
use canopen::{Duration, Frame, NodeId};

use crate::Network;
use crate::bus::BusError;

/// A heartbeat, or a boot-up message, which has the state `Initialising`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Who sent it.
    pub node: NodeId,
    /// Its state.
    pub state: State,
}

impl Heartbeat {
    /// `None` for any other frame.
    #[must_use]
    pub fn parse(frame: &Frame) -> Option<Heartbeat> {
        let &[code] = frame.data() else { return None };
        let node = u8::try_from(frame.id().checked_sub(0x700)?).ok().and_then(NodeId::new)?;
        Some(Heartbeat { node, state: state(code)? })
    }

    /// Waits for the next one of a node that `is_it`; `None` when there was none in this time.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn wait(
        network: &mut Network,
        node: NodeId,
        time: Duration,
        is_it: impl Fn(State) -> bool,
    ) -> Result<Option<State>, BusError> {
        let until = network.now() + time;
        network.wait(until, |frame| {
            Heartbeat::parse(frame)
                .filter(|heard| heard.node == node && is_it(heard.state))
                .map(|heard| heard.state)
        })
    }
}

/// The state of a code.
fn state(code: u8) -> Option<State> {
    let states = [State::Initialising, State::Stopped, State::Operational, State::PreOperational];
    states.into_iter().find(|state| state.code() == code)
}

/// The state in words.
#[must_use]
pub const fn words(state: State) -> &'static str {
    match state {
        State::Initialising => "initialising",
        State::Stopped => "stopped",
        State::Operational => "operational",
        State::PreOperational => "pre-operational",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_is_one_byte_that_names_a_state() {
        let parse = |id, data: &[u8]| Heartbeat::parse(&Frame::new(id, data).unwrap());
        let node = NodeId::new(5).unwrap();
        assert_eq!(parse(0x705, &[5]), Some(Heartbeat { node, state: State::Operational }));
        assert_eq!(parse(0x705, &[0]), Some(Heartbeat { node, state: State::Initialising }));
        for (id, data) in
            [(0x700, &[5][..]), (0x705, &[9]), (0x705, &[]), (0x705, &[5, 5]), (0x785, &[5]), (0x585, &[5])]
        {
            assert_eq!(parse(id, data), None, "{id:X} {data:?}");
        }
    }
}
