//! The shaft and its incremental encoder. The absolute encoder on the same shaft is a device of the SPI.

use canbus::Time;

use super::signal::Signal;

/// The motion of the shaft.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Even motion from the current position, in revolutions per minute; negative is backwards.
    Rpm(f64),
    /// A position as a signal, in revolutions.
    Angle(Signal),
}

/// A shaft with an incremental encoder. A leads B in forward motion. The index is high for one quarter period in each
/// revolution: the quarter at angle 0, in which A and B are both low.
#[derive(Clone, Debug)]
pub(super) struct Shaft {
    motion: Motion,
    since: Time,
    /// Position in revolutions at the instant `since`, at which even motion starts.
    start: f64,
    /// Quarter periods in a revolution: four times the lines of the encoder.
    quarters: i64,
}

impl Shaft {
    pub(super) fn new(lines: u32) -> Self {
        let motion = Motion::Angle(Signal::Constant(0.0));
        Self { motion, since: Time::ZERO, start: 0.0, quarters: 4 * i64::from(lines) }
    }

    pub(super) fn set(&mut self, motion: Motion, now: Time) {
        self.start = self.revolutions(now);
        self.since = now;
        self.motion = motion;
    }

    pub(super) fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Position in revolutions.
    pub(super) fn revolutions(&self, now: Time) -> f64 {
        let age = now.since(self.since);
        match &self.motion {
            // The division is the only rounding: the product is exact for any run of some minutes.
            Motion::Rpm(rpm) => self.start + rpm * age.0 as f64 / (60 * Time::PER_SECOND) as f64,
            Motion::Angle(signal) => signal.at(age),
        }
    }

    /// Position in quarter periods of the encoder.
    pub(super) fn quarter(&self, now: Time) -> i64 {
        (self.revolutions(now) * self.quarters as f64).floor() as i64
    }

    /// Counts of the passed edges of the index: at its begin and at its end. The counts differ while the index is high.
    pub(super) fn index_edges(&self, now: Time) -> (i64, i64) {
        let quarter = self.quarter(now);
        (quarter.div_euclid(self.quarters), (quarter - 1).div_euclid(self.quarters))
    }
}

/// Levels of A and B at a position in quarter periods.
pub(super) fn phases(quarter: i64) -> (bool, bool) {
    let quarter = quarter.rem_euclid(4);
    (matches!(quarter, 1 | 2), matches!(quarter, 2 | 3))
}

/// The first instant after `from`, up to `until`, at which `key` differs from its value at `from`. The instant is exact
/// unless the shaft turns back and forth over an edge in between.
pub(crate) fn first_change<K: PartialEq>(from: Time, until: Time, key: impl Fn(Time) -> K) -> Option<Time> {
    let before = key(from);
    if key(until) == before {
        return None;
    }
    let (mut same, mut changed) = (from.0, until.0);
    while changed - same > 1 {
        let middle = same + (changed - same) / 2;
        if key(Time(middle)) == before { same = middle } else { changed = middle }
    }
    Some(Time(changed))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turning(rpm: f64) -> Shaft {
        let mut shaft = Shaft::new(1024);
        shaft.set(Motion::Rpm(rpm), Time::ZERO);
        shaft
    }

    #[test]
    fn even_motion_counts_exactly() {
        let shaft = turning(6000.0);
        // 100 revolutions a second are 409.6 quarters a millisecond.
        for millis in [5, 10, 12_345, 3_600_000] {
            assert_eq!(shaft.quarter(Time::from_millis(millis)), (millis * 4096 / 10) as i64, "{millis}");
        }
        assert_eq!(turning(-6000.0).quarter(Time::from_millis(15)), -6144);
    }

    #[test]
    fn a_change_of_speed_continues_from_the_position() {
        let mut shaft = turning(6000.0);
        shaft.set(Motion::Rpm(-600.0), Time::from_millis(25));
        assert_eq!(shaft.revolutions(Time::from_millis(25)), 2.5);
        assert_eq!(shaft.revolutions(Time::from_millis(125)), 1.5);
    }

    #[test]
    fn a_leads_b_forwards() {
        let mut shaft = Shaft::new(1);
        let phases = [0.0, 0.25, 0.5, 0.75].map(|angle| {
            shaft.set(Motion::Angle(Signal::Constant(angle)), Time::ZERO);
            phases(shaft.quarter(Time::ZERO))
        });
        assert_eq!(phases, [(false, false), (true, false), (true, true), (false, true)]);
    }

    #[test]
    fn the_edges_of_the_index_are_found_to_the_unit() {
        let shaft = turning(6000.0);
        let high = |at| {
            let (started, ended) = shaft.index_edges(at);
            started != ended
        };
        let rise =
            first_change(Time::from_millis(9), Time::from_millis(11), |t| shaft.index_edges(t)).unwrap();
        assert_eq!(rise, Time::from_millis(10));
        assert!(high(rise) && !high(Time(rise.0 - 1)));
        let fall = first_change(rise, Time::from_millis(11), |t| shaft.index_edges(t)).unwrap();
        // One quarter of 4096 in 10 ms.
        assert_eq!(fall - rise, Time(Time::from_millis(10).0.div_ceil(4096)));
        assert!(!high(fall));
    }
}
