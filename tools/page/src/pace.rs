//! How fast a page may speak.

use std::time::Duration;

use tokio::time::Instant;

/// Messages a second that a page may send for long.
const RATE: u32 = 100;
/// Messages that it may send at once.
const BURST: u32 = 200;

/// Lets through a burst, and then so many a second. Who sends more is not read from for a while, and waits in its own queue.
pub(crate) struct Pace {
    /// When all that was sent is worked off.
    owed_until: Instant,
}

impl Pace {
    pub(crate) fn new(now: Instant) -> Pace {
        Pace { owed_until: now }
    }

    /// A message has come.
    pub(crate) fn count(&mut self, now: Instant) {
        self.owed_until = self.owed_until.max(now) + Duration::from_secs(1) / RATE;
    }

    /// When the next may be read.
    pub(crate) fn next(&self) -> Instant {
        self.owed_until.checked_sub(Duration::from_secs(1) / RATE * BURST).unwrap_or(self.owed_until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_burst_passes_and_a_flood_waits() {
        let start = Instant::now();
        let mut pace = Pace::new(start);
        (0..BURST).for_each(|_| pace.count(start));
        assert!(pace.next() <= start);
        (0..RATE).for_each(|_| pace.count(start));
        assert_eq!(pace.next(), start + Duration::from_secs(1));
        pace.count(start + Duration::from_mins(1));
        assert!(pace.next() <= start + Duration::from_mins(1), "what was long ago is forgotten");
    }
}
