//! The heartbeat consumer (CiA 301, 7.2.8.2.2.2): monitors the heartbeats of other nodes.

use crate::array::{Array, Element};
use crate::nmt::State;
use crate::{CanId, Frame, NodeId, Span, Tick};

/// An entry of 1016h: a node, and the longest time between two of its heartbeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Watch {
    pub(crate) node: NodeId,
    /// Consumer heartbeat time in ms.
    period: u16,
}

impl Watch {
    /// From the value of 1016h: bits 0..15 are the time in ms, bits 16..23 the node-ID. `None` for an unused entry:
    /// time 0, or no valid node-ID.
    #[inline(never)]
    pub(crate) fn parse(value: u32) -> Option<Watch> {
        let [low, high, node, _] = value.to_le_bytes();
        let period = u16::from_le_bytes([low, high]);
        NodeId::new(node).filter(|_| period != 0).map(|node| Watch { node, period })
    }

    fn id(self) -> CanId {
        self.node.service(0x700)
    }
}

/// A change in the state of a monitored node. The number is its entry of 1016h, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// The heartbeat of the node has not arrived in time.
    Lost(u8),
    /// The heartbeat of a lost node has arrived again.
    Back(u8),
}

/// A monitored node, or an unused entry.
#[derive(Clone, Copy, Debug)]
pub struct Monitored {
    watch: Option<Watch>,
    /// When the heartbeat is missing. `NEVER` until the first heartbeat, and while the heartbeat is lost.
    due: Tick,
    is_lost: bool,
    /// The code of the state in the last heartbeat, if one is not missing: `due`.
    code: u8,
}

impl Monitored {
    const fn new(watch: Option<Watch>) -> Monitored {
        Monitored { watch, due: Tick::NEVER, is_lost: false, code: 0 }
    }

    /// The state in the last heartbeat; `None` before the first one, while the heartbeat is lost, and for a reserved code.
    fn state(&self) -> Option<State> {
        if self.due == Tick::NEVER { None } else { State::from_code(self.code) }
    }
}

impl Element for Monitored {
    const NEW: Monitored = Monitored::new(None);
}

/// Monitors nodes, as many as `E` has elements. The monitoring of a node begins with its first heartbeat.
#[derive(Debug)]
pub(crate) struct Consumer<E> {
    entries: E,
}

impl<E: Array<Monitored>> Consumer<E> {
    pub(crate) fn new() -> Consumer<E> {
        Consumer { entries: E::NEW }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.entries.as_mut().iter_mut().for_each(|entry| entry.due.shift(by));
    }

    /// Sets an entry of 1016h, from 0, and restarts its monitoring. Returns whether the old node of the entry was lost.
    pub(crate) fn configure(&mut self, number: usize, watch: Option<Watch>) -> bool {
        let entry = self.entries.as_mut().get_mut(number);
        entry.is_some_and(|entry| core::mem::replace(entry, Monitored::new(watch)).is_lost)
    }

    /// How many nodes can be monitored.
    pub(crate) fn len(&self) -> usize {
        self.entries.as_ref().len()
    }

    /// CAN-IDs of the monitored heartbeats.
    pub(crate) fn ids(&self) -> impl Iterator<Item = CanId> {
        self.entries.as_ref().iter().filter_map(|entry| entry.watch.map(Watch::id))
    }

    /// The monitored nodes, entry by entry.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Option<NodeId>> {
        self.entries.as_ref().iter().map(|entry| entry.watch.map(|watch| watch.node))
    }

    /// Takes a heartbeat or a boot-up message. `changed` gets a new state of a node, and every boot-up.
    pub(crate) fn take(
        &mut self,
        frame: &Frame,
        now: Tick,
        changed: impl FnOnce(NodeId, State),
    ) -> Option<Change> {
        let &[code] = frame.data() else { return None };
        for (number, entry) in (0..).zip(self.entries.as_mut()) {
            if let Some(watch) = entry.watch.filter(|watch| watch.id().get() == frame.id()) {
                let before = entry.state();
                (entry.due, entry.code) = (now.plus(Span::from_millis(watch.period)), code);
                if let Some(state) = entry.state()
                    && (before != Some(state) || state == State::Initialising)
                {
                    changed(watch.node, state);
                }
                return core::mem::take(&mut entry.is_lost).then_some(Change::Back(number));
            }
        }
        None
    }

    /// The state of a monitored node; `None` before its first heartbeat, and while its heartbeat is lost.
    pub(crate) fn state(&self, node: NodeId) -> Option<State> {
        let mut entries = self.entries.as_ref().iter();
        entries.find(|entry| entry.watch.is_some_and(|watch| watch.node == node))?.state()
    }

    /// The entries whose heartbeat is lost, from 0.
    pub(crate) fn lost(&self) -> impl Iterator<Item = u8> {
        (0..).zip(self.entries.as_ref()).filter(|(_, entry)| entry.is_lost).map(|(number, _)| number)
    }

    /// The next instant at which a heartbeat is missing.
    pub(crate) fn due(&self) -> Tick {
        self.entries.as_ref().iter().fold(Tick::NEVER, |due, entry| due.min(entry.due))
    }

    /// Reports one missing heartbeat. Must be called until the result is `None`.
    pub(crate) fn expire(&mut self, now: Tick) -> Option<Change> {
        let (number, entry) = (0..).zip(self.entries.as_mut()).find(|(_, entry)| now >= entry.due)?;
        (entry.due, entry.is_lost) = (Tick::NEVER, true);
        Some(Change::Lost(number))
    }
}
