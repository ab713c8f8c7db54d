//! The host's time by kind of work, to find out what makes a run slow.

use std::fmt;
use std::time::{Duration, Instant};

use serde::{Serialize, Serializer};

/// A kind of work.
#[derive(Clone, Copy, Debug)]
pub enum Work {
    /// The cores and the chips of the boards.
    Boards,
    /// The wait for the boards of other threads.
    Waiting,
    /// The bus.
    Bus,
    /// The clients of the gateway.
    Clients,
    /// Display, log and files.
    Output,
}

/// Names of the kinds of work, in the order of [`Work`].
const NAMES: [&str; 5] = ["boards", "waiting", "bus", "clients", "output"];

/// The host's time by kind of work.
#[derive(Clone, Copy, Debug, Default)]
pub struct HostTime([Duration; NAMES.len()]);

impl HostTime {
    /// Adds the time since `start` to this work, and returns the current time.
    pub fn count(&mut self, work: Work, start: Instant) -> Instant {
        let now = Instant::now();
        self.0[work as usize] += now - start;
        now
    }

    /// The sum of both.
    #[must_use]
    pub fn and(&self, other: &HostTime) -> HostTime {
        HostTime(std::array::from_fn(|work| self.0[work] + other.0[work]))
    }
}

impl fmt::Display for HostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.0.iter().sum::<Duration>().as_secs_f64().max(f64::MIN_POSITIVE);
        let parts = NAMES.iter().zip(&self.0);
        let parts = parts.map(|(name, time)| format!("{name} {:.1} %", time.as_secs_f64() / all * 100.0));
        f.write_str(&parts.collect::<Vec<_>>().join(", "))
    }
}

impl Serialize for HostTime {
    /// Seconds of each kind of work, by name.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(NAMES.iter().zip(self.0.map(|time| time.as_secs_f64())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_counted_time() {
        let time = HostTime([3, 0, 1, 0, 0].map(Duration::from_secs));
        assert_eq!(time.to_string(), "boards 75.0 %, waiting 0.0 %, bus 25.0 %, clients 0.0 %, output 0.0 %");
        assert_eq!(
            HostTime::default().to_string(),
            "boards 0.0 %, waiting 0.0 %, bus 0.0 %, clients 0.0 %, output 0.0 %"
        );
        assert_eq!(serde_json::json!(time)["boards"], 3.0);
    }
}
