//! Decides when the watchdog is fed: after every supervised part has made progress since the last time.

use core::sync::atomic::{AtomicU8, Ordering};

/// A part of the application that must keep going.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Part {
    /// The 1 kHz sampling.
    Sampling = 1,
    /// The task of the process data.
    Process = 2,
    /// The services task.
    Services = 4,
    /// The task that stores parameters. It has the lowest priority, so any task that never ends starves this one.
    Storage = 8,
}

const ALL: u8 = Part::Sampling as u8 | Part::Process as u8 | Part::Services as u8 | Part::Storage as u8;

/// The parts that have made progress since the watchdog was last fed.
#[derive(Debug, Default)]
pub struct Supervision {
    done: AtomicU8,
}

impl Supervision {
    /// No part has made progress yet.
    #[must_use]
    pub const fn new() -> Supervision {
        Supervision { done: AtomicU8::new(0) }
    }

    /// Takes note that `part` has made progress. True if all parts now have: the caller feeds the watchdog.
    pub fn progress(&self, part: Part) -> bool {
        let done = self.done.fetch_or(part as u8, Ordering::Relaxed) | part as u8;
        let complete = done == ALL;
        if complete {
            // A mark set by a higher priority between the two accesses is lost, which only delays the next feed by one
            // period of that part.
            self.done.store(0, Ordering::Relaxed);
        }
        complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTS: [Part; 4] = [Part::Sampling, Part::Process, Part::Services, Part::Storage];

    #[test]
    fn the_watchdog_is_not_fed_while_a_task_is_silent() {
        for silent in PARTS {
            let supervision = Supervision::new();
            let others = PARTS.into_iter().filter(|part| *part != silent);
            assert!(others.cycle().take(1000).all(|part| !supervision.progress(part)), "without {silent:?}");
        }
    }

    #[test]
    fn every_feed_needs_new_progress_of_all() {
        let supervision = Supervision::new();
        for _ in 0..3 {
            let fed = PARTS.map(|part| supervision.progress(part));
            assert_eq!(fed, [false, false, false, true]);
        }
    }
}
