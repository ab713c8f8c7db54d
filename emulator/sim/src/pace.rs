//! Keeps virtual time from running ahead of the host's.

use std::thread;
use std::time::{Duration, Instant};

use canbus::Time;

/// Being late by more than this is forgotten instead of made good: a host that was suspended must not be
/// followed by a burst.
const PATIENCE: Duration = Duration::from_millis(200);

/// Ties the two clocks together.
pub(crate) struct Pace {
    host: Instant,
    world: Time,
}

impl Pace {
    /// Virtual time 0 is now.
    pub(crate) fn new() -> Pace {
        Pace { host: Instant::now(), world: Time::ZERO }
    }

    /// Returns when the host's clock has reached `now`.
    pub(crate) fn wait(&mut self, now: Time) {
        let host = Instant::now();
        match self.lead(now, host) {
            Ok(ahead) => thread::sleep(ahead),
            Err(behind) if behind > PATIENCE => *self = Pace { host, world: now },
            Err(_) => {}
        }
    }

    /// How far virtual time is ahead, or else how far it is behind.
    fn lead(&self, now: Time, host: Instant) -> Result<Duration, Duration> {
        let due = self.host + Duration::from_micros(now.since(self.world).as_micros());
        due.checked_duration_since(host).ok_or_else(|| host - due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lead_is_the_difference_of_the_clocks() {
        let pace = Pace { host: Instant::now(), world: Time::from_millis(100) };
        let later = pace.host + Duration::from_millis(10);
        assert_eq!(pace.lead(Time::from_millis(115), later), Ok(Duration::from_millis(5)));
        assert_eq!(pace.lead(Time::from_millis(103), later), Err(Duration::from_millis(7)));
    }
}
