//! When the watchdog may be fed: after every supervised part has made progress since the last time.

use core::sync::atomic::{AtomicU8, Ordering};

/// A part of the application that must keep going.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Part {
    /// The 1 kHz sampling.
    Sampling = 1,
    /// The services task, which runs below everything that could starve it.
    Services = 2,
}

const ALL: u8 = Part::Sampling as u8 | Part::Services as u8;

/// Who has made progress since the watchdog was last fed.
#[derive(Debug, Default)]
pub struct Supervision {
    done: AtomicU8,
}

impl Supervision {
    /// Nobody yet.
    #[must_use]
    pub const fn new() -> Supervision {
        Supervision { done: AtomicU8::new(0) }
    }

    /// Notes that `part` has made progress. True when that made it complete: feed now.
    pub fn progress(&self, part: Part) -> bool {
        let done = self.done.fetch_or(part as u8, Ordering::Relaxed) | part as u8;
        let complete = done == ALL;
        if complete {
            // A mark set by a higher priority between the two accesses is lost, which delays the next feed by one
            // period of that part and no more.
            self.done.store(0, Ordering::Relaxed);
        }
        complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_part_alone_never_feeds() {
        for part in [Part::Sampling, Part::Services] {
            let supervision = Supervision::new();
            assert!((0..1000).all(|_| !supervision.progress(part)));
        }
    }

    #[test]
    fn every_feed_needs_new_progress_of_both() {
        let supervision = Supervision::new();
        assert!(!supervision.progress(Part::Sampling));
        assert!(supervision.progress(Part::Services));
        assert!(!supervision.progress(Part::Services));
        assert!(supervision.progress(Part::Sampling));
        assert!(!supervision.progress(Part::Sampling));
    }
}
