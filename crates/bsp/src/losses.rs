//! Events that were lost and made good: counted wherever that is noticed, shown to the outside by a task of a low priority.
//!
//! Whatever waits for an event of the hardware has a deadline. When the deadline passes, the event counts as lost, what should
//! have raised it is set up anew, and the node goes on.

use core::sync::atomic::{AtomicU32, Ordering};

/// Kinds of events that can get lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A received frame that found no place in the FIFO or in the queue behind it.
    Frame = 0,
    /// A millisecond of samples that was overwritten before it was collected.
    Millisecond = 1,
    /// The sampling stood still, or its two streams were out of step; it was started anew.
    Sampling = 2,
    /// A word of the absolute encoder that did not come whole; the next millisecond reads the next one.
    SsiWord = 3,
    /// The copy of the count at the index was switched off, and is on again.
    Index = 4,
    /// An alarm of the time base that was noticed by the time and not by its interrupt.
    Alarm = 5,
    /// A write to the memory behind the battery that did not arrive; the next millisecond writes again.
    BackupWrite = 6,
    /// An operation of the flash that did not end in time; whoever asked for it is told.
    Flash = 7,
}

/// How many kinds of [`Event`] there are.
pub const EVENTS: usize = 8;

/// How many of each have been lost since the start.
#[derive(Debug, Default)]
pub struct Losses([AtomicU32; EVENTS]);

impl Losses {
    /// None.
    #[must_use]
    pub const fn new() -> Losses {
        Losses([const { AtomicU32::new(0) }; EVENTS])
    }

    /// One more.
    pub fn count(&self, event: Event) {
        if let Some(counter) = self.0.get(event as usize) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// How many of one kind.
    #[must_use]
    pub fn of(&self, event: Event) -> u32 {
        self.0.get(event as usize).map_or(0, |counter| counter.load(Ordering::Relaxed))
    }

    /// How many of each, in the order of [`Event`].
    #[must_use]
    pub fn all(&self) -> [u32; EVENTS] {
        self.0.each_ref().map(|counter| counter.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_its_own_count() {
        use Event::{Alarm, BackupWrite, Flash, Frame, Index, Millisecond, Sampling, SsiWord};
        let kinds = [Frame, Millisecond, Sampling, SsiWord, Index, Alarm, BackupWrite, Flash];
        let losses = Losses::new();
        for (n, kind) in (1..).zip(kinds) {
            (0..n).for_each(|_| losses.count(kind));
        }
        assert_eq!(losses.all(), [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(kinds.map(|kind| losses.of(kind)), losses.all());
    }
}
