//! The NMT master (CiA 301, 7.3.2.2).

use super::heartbeat::Heartbeat;
use super::service::later;
use super::{Service, Step, Taken};
use crate::nmt::{Command, State};
use crate::{CanId, Duration, Frame, Instant, NodeId};

/// The frame of a command to one node, or to all nodes with `None`. No node acknowledges it.
///
/// ```
/// use canopen::NodeId;
/// use canopen::client::nmt;
/// use canopen::nmt::Command;
///
/// let frame = nmt::command(Command::Start, NodeId::new(5));
/// assert_eq!((frame.id(), frame.data()), (0x000, &[0x01, 5][..]));
/// ```
#[must_use]
pub fn command(command: Command, node: Option<NodeId>) -> Frame {
    let [specifier, node] = command.encode(node);
    Frame::data_frame(CanId::NMT, 2, [specifier, node, 0, 0, 0, 0, 0, 0])
}

/// Sends a command to one node and waits for the heartbeat or boot-up message that shows its effect.
///
/// The output is the state in that message, or `None` when no such message arrived in time. A node without a heartbeat
/// (1017h = 0) sends nothing but its boot-up message.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    command: Command,
    node: NodeId,
    time: Duration,
    /// `None` before the command is sent.
    until: Option<Instant>,
    seen: Option<State>,
}

impl Change {
    /// Waits at most `time` for the effect.
    #[must_use]
    pub const fn new(command: Command, node: NodeId, time: Duration) -> Change {
        Change { command, node, time, until: None, seen: None }
    }

    /// Whether a state shows the effect of the command. For a reset, that is the boot-up message only: by its first
    /// heartbeat, the node may have started itself already.
    fn is_effect(&self, state: State) -> bool {
        match self.command {
            Command::Start => state == State::Operational,
            Command::Stop => state == State::Stopped,
            Command::EnterPreOperational => state == State::PreOperational,
            Command::ResetNode | Command::ResetCommunication => state == State::Initialising,
        }
    }
}

impl Service for Change {
    type Output = Option<State>;

    fn next(&mut self, now: Instant) -> Step<Option<State>> {
        let Some(until) = self.until else {
            self.until = Some(later(now, self.time));
            return Step::Send(command(self.command, Some(self.node)));
        };
        if self.seen.is_some() || now >= until { Step::Done(self.seen) } else { Step::Wait(until) }
    }

    fn on_frame(&mut self, frame: &Frame, _: Instant) -> Taken {
        let heard = Heartbeat::parse(frame).filter(|heard| heard.node == self.node && self.until.is_some());
        match heard {
            Some(heard) if self.seen.is_none() && self.is_effect(heard.state) => {
                self.seen = Some(heard.state);
                Taken::Used
            }
            _ => Taken::Ignored,
        }
    }
}
