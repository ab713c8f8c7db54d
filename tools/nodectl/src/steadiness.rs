//! Whether the clocks of this computer and of the bus ran evenly while something was measured.

use canopen::{Duration, Instant};

/// The deviations of the clocks since a start.
///
/// A frame arrives some time after its time stamp. As long as the computer, the adapter and a simulated bus keep up,
/// this delay is nearly constant.
#[derive(Debug, Default)]
pub(crate) struct Steadiness {
    /// The least and the greatest difference of arrival and time stamp, in microseconds.
    delays: Option<(i128, i128)>,
    /// The longest delay of the end of a pause, in microseconds.
    late: u64,
}

impl Steadiness {
    /// A new measurement. The newest frame so far, with its time stamp and its arrival, has the first delay.
    pub(crate) fn since(newest: Option<(Instant, Instant)>) -> Steadiness {
        let mut new = Steadiness::default();
        if let Some((stamp, arrival)) = newest {
            new.on_frame(stamp, arrival);
        }
        new
    }

    /// Takes the time stamp and the arrival of a frame.
    pub(crate) fn on_frame(&mut self, stamp: Instant, arrival: Instant) {
        let delay = i128::from(arrival.0) - i128::from(stamp.0);
        let (least, most) = self.delays.unwrap_or((delay, delay));
        self.delays = Some((least.min(delay), most.max(delay)));
    }

    /// Takes the intended and the actual end of a pause.
    pub(crate) fn on_pause(&mut self, intended: Instant, actual: Instant) {
        self.late = self.late.max(actual.0.saturating_sub(intended.0));
    }

    /// The longest time for which a clock stood still.
    pub(crate) fn stall(&self) -> Duration {
        let spread = self.delays.map_or(0, |(least, most)| u64::try_from(most - least).unwrap_or(u64::MAX));
        Duration(spread.max(self.late))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_delay_is_no_stall() {
        let mut steadiness = Steadiness::default();
        assert_eq!(steadiness.stall(), Duration(0));
        for stamp in [1_000, 5_000, 900_000] {
            steadiness.on_frame(Instant(stamp), Instant(stamp + 300));
        }
        assert_eq!(steadiness.stall(), Duration(0));
        // The clock of an adapter may be ahead of the clock of this computer.
        let mut ahead = Steadiness::default();
        ahead.on_frame(Instant(u64::MAX), Instant(0));
        ahead.on_frame(Instant(u64::MAX), Instant(40));
        assert_eq!(ahead.stall(), Duration(40));
    }

    #[test]
    fn a_late_frame_and_a_late_end_of_a_pause_are_stalls() {
        let mut steadiness = Steadiness::default();
        steadiness.on_frame(Instant(1_000), Instant(1_300));
        steadiness.on_frame(Instant(2_000), Instant(82_300));
        assert_eq!(steadiness.stall(), Duration(80_000));
        steadiness.on_pause(Instant(100_000), Instant(190_000));
        assert_eq!(steadiness.stall(), Duration(90_000));
        steadiness.on_pause(Instant(200_000), Instant(199_000));
        assert_eq!(steadiness.stall(), Duration(90_000));
    }

    #[test]
    fn a_new_measurement_begins_with_the_newest_delay() {
        let mut steadiness = Steadiness::since(Some((Instant(10), Instant(50_010))));
        assert_eq!(steadiness.stall(), Duration(0));
        // The bus has caught up again: the former delay was a stall of this measurement, too.
        steadiness.on_frame(Instant(70_000), Instant(70_000));
        assert_eq!(steadiness.stall(), Duration(50_000));
    }
}
