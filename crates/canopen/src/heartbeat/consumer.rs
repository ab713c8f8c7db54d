//! The consumer (CiA 301, 7.2.8.2.2.2): watches the heartbeats of other nodes.

use crate::{CanId, Duration, Frame, Instant, NodeId};

/// An entry of 1016h: whose heartbeat must come how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Watch {
    pub(crate) node: NodeId,
    /// In ms.
    period: u16,
}

impl Watch {
    /// From bits 0..15 (time in ms) and 16..23 (node-ID). `None` for an entry that is not used: time 0, or no node-ID.
    pub(crate) fn parse(value: u32) -> Option<Watch> {
        let [low, high, node, _] = value.to_le_bytes();
        let period = u16::from_le_bytes([low, high]);
        NodeId::new(node).filter(|_| period != 0).map(|node| Watch { node, period })
    }

    fn id(self) -> CanId {
        self.node.service(0x700)
    }
}

/// A change in what the consumer knows about a node, with the number of its entry from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Its heartbeat did not come in time.
    Lost(u8),
    /// Its heartbeat is there again.
    Back(u8),
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    watch: Option<Watch>,
    /// `NEVER` until the first heartbeat, and while it is lost.
    due: Instant,
    is_lost: bool,
}

/// Watches up to `W` nodes. Each is watched from its first heartbeat on.
#[derive(Debug)]
pub(crate) struct Consumer<const W: usize> {
    entries: [Entry; W],
}

impl<const W: usize> Consumer<W> {
    pub(crate) const fn new() -> Consumer<W> {
        let unused = Entry { watch: None, due: Instant::NEVER, is_lost: false };
        Consumer { entries: [unused; W] }
    }

    /// Takes an entry of 1016h, from 0. The watch starts afresh; whether its node was lost.
    pub(crate) fn configure(&mut self, number: usize, watch: Option<Watch>) -> bool {
        let fresh = Entry { watch, due: Instant::NEVER, is_lost: false };
        self.entries.get_mut(number).is_some_and(|entry| core::mem::replace(entry, fresh).is_lost)
    }

    /// Identifiers of the heartbeats that it watches.
    pub(crate) fn ids(&self) -> impl Iterator<Item = CanId> {
        self.entries.iter().filter_map(|entry| entry.watch.map(Watch::id))
    }

    /// The nodes that it watches, entry by entry.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Option<NodeId>> {
        self.entries.iter().map(|entry| entry.watch.map(|watch| watch.node))
    }

    /// Takes a heartbeat or a boot-up message.
    pub(crate) fn take(&mut self, frame: &Frame, now: Instant) -> Option<Change> {
        if frame.len() != 1 || frame.is_remote() {
            return None;
        }
        for (number, entry) in (0..).zip(&mut self.entries) {
            if let Some(watch) = entry.watch.filter(|watch| watch.id().get() == frame.id()) {
                entry.due = now + Duration::from_millis(watch.period.into());
                return core::mem::take(&mut entry.is_lost).then_some(Change::Back(number));
            }
        }
        None
    }

    /// The next instant at which a heartbeat is missing.
    pub(crate) fn due(&self) -> Instant {
        self.entries.iter().fold(Instant::NEVER, |due, entry| due.min(entry.due))
    }

    /// A heartbeat that is missing. To be asked until there is none.
    pub(crate) fn expire(&mut self, now: Instant) -> Option<Change> {
        let (number, entry) = (0..).zip(&mut self.entries).find(|(_, entry)| now >= entry.due)?;
        (entry.due, entry.is_lost) = (Instant::NEVER, true);
        Some(Change::Lost(number))
    }
}
