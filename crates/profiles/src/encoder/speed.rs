//! Speed from positions: object 6030h.
//!
//! The difference of two positions over a window. A fast shaft is measured over one or a few milliseconds, so the
//! value follows at once; a slow one over up to 128 ms, so a single step still counts. The window is the shortest
//! one in which the shaft moved [`ENOUGH`] steps: the value is then exact to 1 in `ENOUGH`, and after a stop it falls
//! steadily to zero.

use core::num::NonZeroU64;

/// Longest window in samples.
const WINDOW: u32 = 128;

/// Steps in a window that make it long enough.
const ENOUGH: u32 = 64;

/// A positive fraction that turns native steps per second into units of 6030h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ratio {
    /// Units.
    pub numerator: u32,
    /// Per this many native steps a second.
    pub denominator: NonZeroU64,
}

/// Remembers the last 128 positions, one a millisecond.
#[derive(Clone, Debug)]
pub struct Speedometer {
    positions: [u32; WINDOW as usize],
    next: u32,
}

impl Speedometer {
    /// A shaft that has stood at `position`.
    #[must_use]
    pub fn new(position: u32) -> Speedometer {
        Speedometer { positions: [position; WINDOW as usize], next: 0 }
    }

    /// Takes the position in native steps, counted modulo 2^32 without end, and returns the speed in units,
    /// saturated to INTEGER16.
    pub fn update(&mut self, position: u32, ratio: Ratio) -> i16 {
        let (moved, millis) = self.window(position);
        if let Some(oldest) = self.positions.get_mut(self.next as usize) {
            *oldest = position;
        }
        self.next = (self.next + 1) % WINDOW;
        scaled(moved, millis, ratio)
    }

    /// The movement in the shortest window that is long enough, and its length in milliseconds.
    fn window(&self, position: u32) -> (i32, u32) {
        let moved = |millis| position.wrapping_sub(self.ago(millis)).cast_signed();
        let millis = (1..WINDOW).find(|millis| moved(*millis).unsigned_abs() >= ENOUGH).unwrap_or(WINDOW);
        (moved(millis), millis)
    }

    /// The position `millis` samples before the one that comes next.
    fn ago(&self, millis: u32) -> u32 {
        let index = (self.next + WINDOW - millis) % WINDOW;
        self.positions.get(index as usize).copied().unwrap_or(0)
    }
}

/// `moved / millis * 1000 * ratio`, rounded towards zero.
fn scaled(moved: i32, millis: u32, ratio: Ratio) -> i16 {
    let units = u128::from(moved.unsigned_abs()) * 1000 * u128::from(ratio.numerator);
    let per = u128::from(ratio.denominator.get()) * u128::from(millis);
    let speed = i16::try_from(units.checked_div(per).unwrap_or(0)).unwrap_or(i16::MAX);
    match (moved < 0, speed) {
        (true, i16::MAX) => i16::MIN,
        (true, speed) => -speed,
        (false, speed) => speed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNITS: Ratio = Ratio { numerator: 1, denominator: NonZeroU64::MIN };

    /// Steps per second exactly, sampled at whole milliseconds.
    fn turn(per_second: i64, millis: i64, ratio: Ratio) -> i16 {
        let mut speedometer = Speedometer::new(0);
        let mut speed = 0;
        for t in 1..=millis {
            let position = (per_second * t).div_euclid(1000);
            speed = speedometer.update(u32::try_from(position.rem_euclid(1 << 32)).unwrap(), ratio);
        }
        speed
    }

    #[test]
    fn stands_still_at_zero() {
        assert_eq!(turn(0, 500, UNITS), 0);
    }

    #[test]
    fn is_within_one_part_in_64_from_low_to_top_speed() {
        for per_second in [500, 1_000, 5_000, 20_000, 32_000] {
            for direction in [1, -1] {
                let speed = i64::from(turn(per_second * direction, 300, UNITS));
                let error = (speed - per_second * direction).abs();
                assert!(error * 64 <= per_second, "{speed} for {}", per_second * direction);
            }
        }
    }

    #[test]
    fn a_creeping_shaft_shows() {
        let speed = turn(16, 1000, UNITS);
        assert!((8..=24).contains(&speed), "{speed}");
    }

    #[test]
    fn saturates() {
        assert_eq!(turn(1_000_000, 10, UNITS), i16::MAX);
        assert_eq!(turn(-1_000_000, 10, UNITS), i16::MIN);
    }

    /// 6000 rpm of a sensor with 4096 steps, in units of a tenth of a degree, across the wrap of the counter.
    #[test]
    fn converts_to_units_and_does_not_jump_at_the_wrap() {
        let ratio = Ratio { numerator: 3600, denominator: NonZeroU64::new(4096 * 100).unwrap() };
        let mut speedometer = Speedometer::new(u32::MAX - 10_000);
        let mut position = u32::MAX - 10_000;
        let mut speeds = (0..100).map(|_| {
            position = position.wrapping_add(4096 / 10);
            speedometer.update(position, ratio)
        });
        assert!(speeds.all(|speed| (3590..=3600).contains(&speed)));
    }

    #[test]
    fn follows_a_stop_within_the_window() {
        let mut speedometer = Speedometer::new(0);
        for t in 1..=50_u32 {
            speedometer.update(t * 100, UNITS);
        }
        let stopped: Vec<i16> = (0..128).map(|_| speedometer.update(5000, UNITS)).collect();
        assert_eq!(stopped.last(), Some(&0));
        assert!(stopped.windows(2).all(|pair| pair[1] <= pair[0]));
    }
}
