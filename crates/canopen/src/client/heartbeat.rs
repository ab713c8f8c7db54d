//! Heartbeats and boot-up messages of other nodes (CiA 301, 7.2.8.2.2 and 7.2.8.3.2).

use super::service::later;
use crate::nmt::State;
use crate::{Duration, Frame, Instant, NodeId};

/// A heartbeat. A boot-up message has the state [`State::Initialising`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// The producer of the heartbeat.
    pub node: NodeId,
    /// The NMT state of the producer.
    pub state: State,
}

impl Heartbeat {
    /// `None` for any other frame. A frame with a toggle bit is a node guarding response and no heartbeat.
    #[must_use]
    pub fn parse(frame: &Frame) -> Option<Heartbeat> {
        let &[code] = frame.data() else { return None };
        let node = u8::try_from(frame.id().checked_sub(0x700)?).ok().and_then(NodeId::new)?;
        Some(Heartbeat { node, state: State::from_code(code)? })
    }
}

/// A change in the state of a supervised node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// The node has booted up.
    BootUp(NodeId),
    /// The node has changed its state, or its first heartbeat has arrived.
    State(NodeId, State),
    /// The heartbeat of the node has not arrived in time.
    Lost(NodeId),
}

#[derive(Clone, Copy, Debug)]
struct Watched {
    node: NodeId,
    /// The longest time between two heartbeats.
    time: Duration,
    /// When the next heartbeat is missing. `NEVER` before the first heartbeat and after a missing one.
    due: Instant,
    /// The newest state; `None` before the first heartbeat and after a missing one.
    state: Option<State>,
}

/// Supervises the heartbeats of up to `N` nodes. The supervision of a node begins with its first heartbeat.
///
/// ```
/// use canopen::client::heartbeat::{Event, Supervisor};
/// use canopen::nmt::State;
/// use canopen::{Duration, Frame, Instant, NodeId};
///
/// let node = NodeId::new(5).ok_or("a node-ID")?;
/// let mut supervisor = Supervisor::<4>::new();
/// assert!(supervisor.watch(node, Duration::from_millis(1500)));
/// let heartbeat = Frame::new(0x705, &[0x05]).ok_or("a frame")?;
/// let event = supervisor.on_frame(&heartbeat, Instant(0));
/// assert_eq!(event, Some(Event::State(node, State::Operational)));
/// assert_eq!(supervisor.due(), Instant(1_500_000));
/// assert_eq!(supervisor.expire(Instant(1_500_000)), Some(Event::Lost(node)));
/// assert_eq!(supervisor.state(node), None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Supervisor<const N: usize> {
    nodes: [Option<Watched>; N],
}

impl<const N: usize> Default for Supervisor<N> {
    fn default() -> Supervisor<N> {
        Supervisor::new()
    }
}

impl<const N: usize> Supervisor<N> {
    /// A supervisor without nodes.
    #[must_use]
    pub const fn new() -> Supervisor<N> {
        Supervisor { nodes: [None; N] }
    }

    /// Supervises a node from now on. `time` is the longest time between two heartbeats; it should be longer than the
    /// producer heartbeat time (1017h) of the node. `false` when `N` other nodes are supervised already.
    pub fn watch(&mut self, node: NodeId, time: Duration) -> bool {
        self.forget(node);
        let Some(free) = self.nodes.iter_mut().find(|entry| entry.is_none()) else { return false };
        *free = Some(Watched { node, time, due: Instant::NEVER, state: None });
        true
    }

    /// Ends the supervision of a node.
    pub fn forget(&mut self, node: NodeId) {
        for entry in &mut self.nodes {
            if entry.is_some_and(|watched| watched.node == node) {
                *entry = None;
            }
        }
    }

    /// The newest state of a node; `None` when the node is not supervised or its heartbeat is missing.
    #[must_use]
    pub fn state(&self, node: NodeId) -> Option<State> {
        self.nodes.iter().flatten().find(|watched| watched.node == node)?.state
    }

    /// Takes a frame from the bus. A heartbeat with an unchanged state gives no event.
    pub fn on_frame(&mut self, frame: &Frame, now: Instant) -> Option<Event> {
        let heard = Heartbeat::parse(frame)?;
        let watched = self.nodes.iter_mut().flatten().find(|watched| watched.node == heard.node)?;
        watched.due = later(now, watched.time);
        let before = watched.state.replace(heard.state);
        match heard.state {
            State::Initialising => Some(Event::BootUp(heard.node)),
            state => (before != Some(state)).then_some(Event::State(heard.node, state)),
        }
    }

    /// The next instant at which a heartbeat is missing.
    #[must_use]
    pub fn due(&self) -> Instant {
        self.nodes.iter().flatten().fold(Instant::NEVER, |due, watched| due.min(watched.due))
    }

    /// Reports one node whose heartbeat is missing. Call again until the result is `None`.
    pub fn expire(&mut self, now: Instant) -> Option<Event> {
        let is_late = |watched: &&mut Watched| watched.due != Instant::NEVER && now >= watched.due;
        let watched = self.nodes.iter_mut().flatten().find(is_late)?;
        (watched.due, watched.state) = (Instant::NEVER, None);
        Some(Event::Lost(watched.node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_is_the_byte_of_a_state() {
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

    #[test]
    fn a_supervisor_reports_new_and_missing_nodes() {
        let [a, b, c] = [5, 6, 7].map(|id| NodeId::new(id).unwrap());
        let mut supervisor = Supervisor::<2>::new();
        assert!(supervisor.watch(a, Duration(100)) && supervisor.watch(b, Duration(200)));
        assert!(!supervisor.watch(c, Duration(100)));
        let mut heard = |node: NodeId, code, now| {
            let frame = Frame::new(0x700 + u16::from(node.get()), &[code]).unwrap();
            supervisor.on_frame(&frame, Instant(now))
        };
        assert_eq!(heard(a, 0, 0), Some(Event::BootUp(a)));
        assert_eq!(heard(a, 0x7F, 10), Some(Event::State(a, State::PreOperational)));
        assert_eq!(heard(a, 0x7F, 20), None);
        assert_eq!(heard(b, 5, 20), Some(Event::State(b, State::Operational)));
        assert_eq!(heard(c, 4, 20), None);
        let states = [a, b, c].map(|node| supervisor.state(node));
        assert_eq!(states, [Some(State::PreOperational), Some(State::Operational), None]);
        assert_eq!((supervisor.due(), supervisor.expire(Instant(119))), (Instant(120), None));
        assert_eq!(supervisor.expire(Instant(250)), Some(Event::Lost(a)));
        assert_eq!(supervisor.expire(Instant(250)), Some(Event::Lost(b)));
        assert_eq!((supervisor.expire(Instant(250)), supervisor.due()), (None, Instant::NEVER));
        supervisor.forget(a);
        assert!(supervisor.watch(c, Duration(100)));
    }
}
