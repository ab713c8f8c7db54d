//! Counts of hardware events that were lost and recovered from. The part that detects a loss counts it; a task of low
//! priority shows the counts.
//!
//! Every wait for a hardware event has a deadline. When the deadline passes, the event counts as lost, its source is
//! set up again, and the node continues.

use core::sync::atomic::{AtomicU32, Ordering};

/// Kinds of events that can be lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A received frame for which the FIFO or the queue behind it had no room, or whose mailbox was not released in time.
    Frame = 0,
    /// A millisecond of samples that was overwritten before it was collected.
    Millisecond = 1,
    /// The sampling had stopped, or its two streams were out of step; it was restarted.
    Sampling = 2,
    /// An incomplete word of the absolute encoder; the next millisecond reads the next one.
    SsiWord = 3,
    /// The stream that copies the count at the index was off; it was switched on again.
    Index = 4,
    /// An alarm of the time base that was detected by its time and not by its interrupt.
    Alarm = 5,
    /// A failed write to the battery-backed memory; the next millisecond writes again.
    BackupWrite = 6,
    /// A flash operation that did not end in time; its caller gets an error.
    Flash = 7,
    /// The CAN controller did not leave the bus in time; it was reset.
    CanMode = 8,
    /// A change of the parameter memory was refused, because the supply was below 2.9 V.
    Supply = 9,
}

/// Number of kinds of [`Event`].
pub const EVENTS: usize = 10;

/// The number of lost events of each kind since the start.
#[derive(Debug, Default)]
pub struct Losses([AtomicU32; EVENTS]);

impl Losses {
    /// Counters at zero.
    #[must_use]
    pub const fn new() -> Losses {
        Losses([const { AtomicU32::new(0) }; EVENTS])
    }

    /// Counts an event.
    pub fn count(&self, event: Event) {
        if let Some(counter) = self.0.get(event as usize) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The count of one kind.
    #[must_use]
    pub fn of(&self, event: Event) -> u32 {
        self.0.get(event as usize).map_or(0, |counter| counter.load(Ordering::Relaxed))
    }

    /// The counts of all kinds, in the order of [`Event`].
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
        use Event::{
            Alarm, BackupWrite, CanMode, Flash, Frame, Index, Millisecond, Sampling, SsiWord, Supply,
        };
        let kinds =
            [Frame, Millisecond, Sampling, SsiWord, Index, Alarm, BackupWrite, Flash, CanMode, Supply];
        let losses = Losses::new();
        for (n, kind) in (1..).zip(kinds) {
            (0..n).for_each(|_| losses.count(kind));
        }
        assert_eq!(losses.all(), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        assert_eq!(kinds.map(|kind| losses.of(kind)), losses.all());
    }
}
