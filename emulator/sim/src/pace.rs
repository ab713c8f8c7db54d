//! Keeps virtual time from running ahead of the host's.

use std::thread;
use std::time::{Duration, Instant};

use canbus::Time;

/// A longer delay is not caught up: after a suspension of the host, the simulation must not run in a burst.
const PATIENCE: Duration = Duration::from_millis(200);

/// The relation of the two clocks.
pub(crate) struct Pace {
    host: Instant,
    world: Time,
}

impl Pace {
    /// A pace with virtual time 0 at the current time of the host.
    pub(crate) fn new() -> Pace {
        Pace { host: Instant::now(), world: Time::ZERO }
    }

    /// Waits until the host's clock has reached `now`.
    pub(crate) fn wait(&mut self, now: Time) {
        let host = Instant::now();
        match self.lead(now, host) {
            Ok(ahead) => thread::sleep(ahead),
            Err(behind) if behind > PATIENCE => *self = Pace { host, world: now },
            Err(_) => {}
        }
    }

    /// The lead of virtual time over the host's clock; the error is its delay.
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
