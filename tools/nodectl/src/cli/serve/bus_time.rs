//! The time axis of the pages: seconds on the bus.

use canopen::Instant;

/// Turns time stamps of the adapter into seconds since the first frame. The axis continues when the adapter is opened
/// again, although its time stamps may start elsewhere then.
#[derive(Debug, Default)]
pub(super) struct BusTime {
    /// A time stamp, and its time on the axis.
    origin: Option<(Instant, f64)>,
    /// The newest time on the axis, and the time of this computer's clock at that moment.
    newest: Option<(f64, Instant)>,
}

impl BusTime {
    /// The time of a frame that has just arrived.
    pub(super) fn of_frame(&mut self, stamp: Instant, here: Instant) -> f64 {
        let (first, base) = match self.origin {
            Some(origin) => origin,
            None => *self.origin.insert((stamp, self.now(here))),
        };
        let t = base + seconds(first, stamp);
        self.newest = Some((t, here));
        t
    }

    /// The present time; 0 before the first frame.
    pub(super) fn now(&self, here: Instant) -> f64 {
        self.newest.map_or(0.0, |(t, then)| t + seconds(then, here))
    }

    /// Prepares for the time stamps of another adapter.
    pub(super) fn restart(&mut self) {
        self.origin = None;
    }
}

#[allow(clippy::cast_precision_loss)] // The error is a microsecond in a hundred years.
fn seconds(from: Instant, to: Instant) -> f64 {
    if to.0 >= from.0 { (to.0 - from.0) as f64 / 1e6 } else { -((from.0 - to.0) as f64 / 1e6) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_begins_with_the_first_frame_and_continues_with_another_adapter() {
        let mut time = BusTime::default();
        assert_eq!(time.now(Instant(7)), 0.0);
        assert_eq!(time.of_frame(Instant(5_000_000), Instant(0)), 0.0);
        assert_eq!(time.of_frame(Instant(5_500_000), Instant(600_000)), 0.5);
        assert_eq!(time.now(Instant(1_600_000)), 1.5);
        time.restart();
        assert_eq!(time.of_frame(Instant(0), Instant(2_600_000)), 2.5);
        assert_eq!(time.of_frame(Instant(250_000), Instant(3_000_000)), 2.75);
    }
}
