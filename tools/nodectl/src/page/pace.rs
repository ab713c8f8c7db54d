//! The limit on the messages of a page.

use std::time::Duration;

use tokio::time::Instant;

/// Messages a second that a page may send continuously.
const RATE: u32 = 100;
/// Messages that a page may send at once.
const BURST: u32 = 200;

/// Allows a burst, and then a constant rate. A page that sends more is not read for a while; its messages wait in its
/// own queue.
pub(crate) struct Pace {
    /// The time at which all messages are paid off at the constant rate.
    owed_until: Instant,
}

impl Pace {
    pub(crate) fn new(now: Instant) -> Pace {
        Pace { owed_until: now }
    }

    /// Counts a message.
    pub(crate) fn count(&mut self, now: Instant) {
        self.owed_until = self.owed_until.max(now) + Duration::from_secs(1) / RATE;
    }

    /// The time at which the next message may be read.
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
