//! The time after which a node in bus-off returns to the bus.
//!
//! CAN lets a node return after 128 times 11 recessive bits, 1.4 ms at 1 Mbit/s. A node whose line is shorted would
//! then disturb the others hundreds of times a second. The node therefore waits 50 ms at first, and twice as long each
//! time it fails again, up to 3.2 s. After 10 s without a bus-off the waiting time starts again at 50 ms.

use canopen::{Duration, Instant};

const FIRST: Duration = Duration::from_millis(50);
const LONGEST: Duration = Duration::from_millis(3_200);
/// Time on the bus without a bus-off after which the waiting time starts again at `FIRST`.
const GOOD: Duration = Duration::from_millis(10_000);
/// Time for the recovery of the controller, which takes 141 ms at 10 kbit/s. A node that is still off the bus
/// afterwards has failed again.
const WAY_BACK: Duration = Duration::from_millis(200);

/// The waiting times of a node.
#[derive(Debug)]
pub struct BackOff {
    next: Duration,
    /// Time to return, while off the bus.
    due: Option<Instant>,
    /// Time of the last return.
    returned: Option<Instant>,
}

impl Default for BackOff {
    fn default() -> BackOff {
        BackOff { next: FIRST, due: None, returned: None }
    }
}

impl BackOff {
    /// The node is off the bus. To be called repeatedly while the node is off the bus.
    pub fn bus_off(&mut self, now: Instant) {
        let is_returning = self.returned.is_some_and(|returned| now < returned + WAY_BACK);
        if self.due.is_some() || is_returning {
            return;
        }
        if self.returned.is_none_or(|returned| now > returned + GOOD) {
            self.next = FIRST;
        }
        self.due = Some(now + self.next);
        self.next = Duration(self.next.0 * 2).min(LONGEST);
    }

    /// Whether to begin the recovery now. True once for each bus-off.
    pub fn is_over(&mut self, now: Instant) -> bool {
        let is_over = self.due.is_some_and(|due| now >= due);
        if is_over {
            (self.due, self.returned) = (None, Some(now));
        }
        is_over
    }

    /// Time at which to ask [`is_over`](BackOff::is_over) again.
    #[must_use]
    pub fn due(&self) -> Instant {
        self.due.unwrap_or(Instant::NEVER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waits for the return, then fails again. Returns the waiting time in ms.
    fn wait(back_off: &mut BackOff, now: &mut Instant) -> u64 {
        back_off.bus_off(*now);
        let due = back_off.due();
        back_off.bus_off(*now + Duration(1));
        assert!(!back_off.is_over(Instant(due.0 - 1)));
        assert!(back_off.is_over(due));
        assert!(!back_off.is_over(due), "once");
        back_off.bus_off(due + Duration(1));
        assert_eq!(back_off.due(), Instant::NEVER, "on the way back");
        let waited = due.0 - now.0;
        *now = due + WAY_BACK;
        waited / 1000
    }

    #[test]
    fn it_waits_longer_each_time_until_the_bus_is_good() {
        let (mut back_off, mut now) = (BackOff::default(), Instant(500_000));
        let waits = [(); 9].map(|()| wait(&mut back_off, &mut now));
        assert_eq!(waits, [50, 100, 200, 400, 800, 1600, 3200, 3200, 3200]);
        now = now + GOOD;
        assert_eq!(wait(&mut back_off, &mut now), 50);
    }

    #[test]
    fn without_a_bus_off_nothing_is_due() {
        let mut back_off = BackOff::default();
        assert_eq!(back_off.due(), Instant::NEVER);
        assert!(!back_off.is_over(Instant::NEVER));
    }
}
