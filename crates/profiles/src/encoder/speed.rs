//! Speed from positions: object 6030h.
//!
//! The speed is a number of steps divided by the time between two changes of the position (the M/T method). The steps
//! are exact, and the time is exact to the millisecond. One rule therefore serves a fast shaft, whose position changes
//! every millisecond, and a slow one, whose position changes once in many:
//!
//! * The interval ends at the last change and starts 1, 2, 4 .. 128 changes before. It is the shortest with 256 steps
//!   or 128 ms, but not beyond 256 ms, except for the interval of a single change. The result is exact to 1 %. The
//!   search starts from the interval before, which may at most double its number of changes, or shrink to any.
//! * While the position does not change, the speed is at most one step in the time since the last change. After
//!   [`STANDSTILL`] it is 0.
//!
//! A shaft that starts or stops therefore shows after a few milliseconds, and one that dithers between two steps stands
//! still.

/// Number of changes that are stored.
const MARKS: u32 = 128;
/// Steps that make an interval long enough for 1 %.
const ENOUGH_STEPS: u32 = 256;
/// Milliseconds that make an interval long enough for 1 %.
const ENOUGH_TIME: u32 = 128;
/// Milliseconds beyond which an interval is too old to describe the present speed.
const TOO_LONG: u32 = 256;
/// Milliseconds without a change after which the speed is 0, so a speed below about one step a second reads as 0.
pub const STANDSTILL: u32 = 1024;

/// A change of the position.
#[derive(Clone, Copy, Debug)]
struct Mark {
    /// Time in milliseconds.
    time: u32,
    /// Movement up to this time.
    count: u32,
}

/// Movement between two changes.
#[derive(Clone, Copy, Debug)]
struct Interval {
    steps: i32,
    /// Length in milliseconds.
    time: u32,
}

impl Interval {
    fn is_enough(self) -> bool {
        self.steps.unsigned_abs() >= ENOUGH_STEPS || self.time >= ENOUGH_TIME
    }
}

/// Computes the speed from the last 128 changes.
#[derive(Clone, Debug)]
pub struct Speedometer {
    marks: [Mark; MARKS as usize],
    next: u32,
    /// Number of changes in the present interval.
    changes: u32,
    last: Mark,
    now: u32,
    /// Speed in steps per millisecond.
    rate: f32,
}

impl Speedometer {
    /// A speedometer of a shaft at rest, with its movement counted modulo 2^32 from `count`.
    #[must_use]
    pub fn new(count: u32) -> Speedometer {
        let last = Mark { time: 0, count };
        Speedometer { marks: [last; MARKS as usize], next: 0, changes: 1, last, now: STANDSTILL, rate: 0.0 }
    }

    /// Takes the movement up to now, once a millisecond; returns steps per second.
    #[allow(clippy::cast_precision_loss)] // The result has 15 bits, less than 24.
    pub fn update(&mut self, count: u32) -> f32 {
        self.now = self.now.wrapping_add(1);
        let silence = self.now.wrapping_sub(self.last.time);
        if count != self.last.count {
            let now = Mark { time: self.now, count };
            self.rate = self.rate_until(now);
            self.remember(now);
        } else if silence >= STANDSTILL {
            self.rate = 0.0;
        } else {
            let most = 1.0 / silence as f32;
            self.rate = self.rate.max(-most).min(most);
        }
        self.rate * 1000.0
    }

    #[allow(clippy::cast_precision_loss)]
    fn rate_until(&mut self, now: Mark) -> f32 {
        let mut changes = (self.changes * 2).min(MARKS);
        let mut interval = self.since(changes, now);
        while changes > 1 {
            let half = self.since(changes / 2, now);
            if interval.time <= TOO_LONG && !half.is_enough() {
                break;
            }
            (changes, interval) = (changes / 2, half);
        }
        self.changes = changes;
        interval.steps as f32 / interval.time as f32
    }

    /// The interval since `changes` changes before.
    fn since(&self, changes: u32, now: Mark) -> Interval {
        let index = self.next.wrapping_sub(changes) % MARKS;
        let mark = self.marks.get(index as usize).copied().unwrap_or(self.last);
        let steps = now.count.wrapping_sub(mark.count).cast_signed();
        Interval { steps, time: now.time.wrapping_sub(mark.time) }
    }

    fn remember(&mut self, mark: Mark) {
        if let Some(oldest) = self.marks.get_mut(self.next as usize) {
            *oldest = mark;
        }
        self.next = (self.next + 1) % MARKS;
        self.last = mark;
    }
}

/// Converts steps per second to the value of 6030h: in units, rounded to the nearest, saturated to INTEGER16.
#[must_use]
#[allow(clippy::cast_possible_truncation)] // The value is in the range.
pub fn speed_value(per_second: f32, units_per_step: f32) -> i16 {
    rounded(per_second * units_per_step).clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

/// The nearest whole number, saturated to INTEGER32.
#[allow(clippy::cast_possible_truncation)] // `as` saturates.
pub(super) fn rounded(value: f32) -> i32 {
    (if value < 0.0 { value - 0.5 } else { value + 0.5 }) as i32
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Turns evenly from `start` and returns the speed at every millisecond.
    fn turn(start: u32, per_second: f64, millis: i64) -> Vec<f32> {
        let mut speedometer = Speedometer::new(start);
        let at = |t: i64| (per_second * t as f64 / 1000.0).floor() as i64;
        (1..=millis).map(|t| speedometer.update(start.wrapping_add(at(t) as u32))).collect()
    }

    fn deviation(speed: f32, per_second: f64) -> f64 {
        (f64::from(speed) - per_second).abs() / per_second.abs()
    }

    proptest! {
        /// From one step in half a second to 30 steps in a microsecond, wherever the counter wraps.
        #[test]
        fn is_exact_to_one_per_cent_at_any_speed(start: u32, exponent in 0.31..7.4_f64, backwards: bool) {
            let per_second = 10_f64.powf(exponent) * if backwards { -1.0 } else { 1.0 };
            for speed in turn(start, per_second, 1500).split_off(1000) {
                prop_assert!(deviation(speed, per_second) < 0.01, "{} for {}", speed, per_second);
            }
        }

        #[test]
        fn any_movement_gives_a_number(counts in prop::collection::vec(any::<u32>(), 1..300), factor in 0.0..1e9_f32) {
            let mut speedometer = Speedometer::new(0);
            for count in counts {
                let speed = speedometer.update(count);
                prop_assert!(speed.is_finite() && (speed * factor).is_finite());
            }
        }
    }

    #[test]
    fn stands_still_at_zero() {
        assert!(turn(7, 0.0, 5000).iter().all(|speed| *speed == 0.0));
    }

    #[test]
    fn a_start_shows_in_the_second_millisecond() {
        for per_second in [-3_000_000.0, 409_600.0] {
            let speeds = turn(0, per_second, 3);
            assert!(speeds[1..].iter().all(|speed| deviation(*speed, per_second) < 0.01), "{speeds:?}");
        }
    }

    #[test]
    fn a_stop_shows_at_once_and_falls_to_zero() {
        let mut speedometer = Speedometer::new(0);
        (1..=50_u32).for_each(|t| _ = speedometer.update(t * 100));
        let stopped: Vec<f32> = (0..STANDSTILL).map(|_| speedometer.update(5000)).collect();
        assert!(stopped[0] <= 1000.0 && stopped[9] <= 100.0);
        assert!(stopped.windows(2).all(|pair| pair[1] <= pair[0]));
        assert_eq!(stopped.last(), Some(&0.0));
    }

    #[test]
    fn a_turn_back_shows_the_other_way() {
        let mut speedometer = Speedometer::new(0);
        (1..=100_u32).for_each(|t| _ = speedometer.update(t * 400));
        let back: Vec<f32> = (1..=3).map(|t| speedometer.update(40_000 - t * 400)).collect();
        assert!(back.iter().all(|speed| deviation(*speed, -400_000.0) < 0.01), "{back:?}");
    }

    /// Two steps a second, then a hundred: the long pauses before do not affect the present speed.
    #[test]
    fn the_average_of_a_slow_shaft_restarts_when_it_speeds_up() {
        let mut speedometer = Speedometer::new(0);
        (1..=3000_u32).for_each(|t| _ = speedometer.update(t / 500));
        let speeds: Vec<f32> = (1..=300_u32).map(|t| speedometer.update(6 + t / 10)).collect();
        assert!(speeds[20..].iter().all(|speed| deviation(*speed, 100.0) < 0.01), "{speeds:?}");
    }

    #[test]
    fn dithering_between_two_steps_is_no_speed() {
        let mut speedometer = Speedometer::new(0);
        let speeds = (0..1000_u32).map(|t| speedometer.update(t % 2)).skip(200);
        assert!(speeds.into_iter().all(|speed| speed == 0.0));
    }

    #[test]
    fn rounds_and_saturates() {
        for (speed, factor, value) in [
            (409_600.0, 3600.0 / 4096.0 / 100.0, 3600),
            (0.49, 1.0, 0),
            (-0.51, 1.0, -1),
            (32_766.6, 1.0, 32_767),
            (1e9, 1.0, i16::MAX),
            (-1e9, 1.0, i16::MIN),
        ] {
            assert_eq!(speed_value(speed, factor), value);
        }
    }
}
