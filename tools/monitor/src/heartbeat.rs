//! The heartbeat of one node (1017h).

use canopen::{Duration, Instant};

/// The producer time and the last heartbeat.
#[derive(Debug, Default)]
pub(crate) struct Heartbeat {
    last: Option<Instant>,
    is_reported: bool,
}

impl Heartbeat {
    /// A heartbeat or a boot-up message was sent, or a new time is set.
    pub(crate) fn begin(&mut self, now: Instant) {
        (self.last, self.is_reported) = (Some(now), false);
    }

    /// The time restarts.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.last = self.last.map(|_| now);
    }

    /// The node sends no heartbeats for now: it restarts, or changes its bit rate.
    pub(crate) fn pause(&mut self) {
        self.last = None;
    }

    /// The span in which a missing heartbeat should have been sent; once for each heartbeat.
    pub(crate) fn overdue(&mut self, period: Duration, now: Instant) -> Option<(Instant, Instant)> {
        let last = self.last.filter(|_| period.0 > 0 && !self.is_reported)?;
        let (due, late) = (last + period, last + Duration(period.0 * 3 / 2));
        if now <= late {
            return None;
        }
        self.is_reported = true;
        Some((due, late))
    }
}
