//! Where the shaft is, counted without end.

use core::num::NonZeroU32;

/// A mechanical position in native steps: whole revolutions since some origin, and the step within one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shaft {
    /// Whole revolutions, negative below the origin.
    pub turns: i64,
    /// Native step within the revolution, below the steps per revolution.
    pub step: u32,
}

/// Follows a counter that wraps (a 16-bit timer, a single-turn or multi-turn word) without losing revolutions.
///
/// Between two updates the shaft may turn less than half of what the counter can tell apart; a faster shaft is
/// taken for a slower one in the other direction, as with every counter.
#[derive(Clone, Debug)]
pub struct Tracker {
    per_revolution: NonZeroU32,
    modulus: u64,
    last: u32,
    shaft: Shaft,
}

impl Tracker {
    /// A counter that runs from 0 to `modulus - 1` (a modulus of zero means 2^32), with `per_revolution` native
    /// steps, which stands at `raw` while the shaft is at `at`.
    #[must_use]
    pub fn new(per_revolution: NonZeroU32, modulus: u32, raw: u32, at: Shaft) -> Tracker {
        let modulus = if modulus == 0 { 1 << 32 } else { u64::from(modulus) };
        let step = at.step.min(per_revolution.get() - 1);
        Tracker { per_revolution, modulus, last: raw, shaft: Shaft { step, ..at } }
    }

    /// Takes a new reading of the counter and returns where the shaft is.
    pub fn update(&mut self, raw: u32) -> Shaft {
        let delta = self.shortest(raw);
        self.last = raw;
        self.advance(delta);
        self.shaft
    }

    /// Where the shaft was at the last update.
    #[must_use]
    pub fn shaft(&self) -> Shaft {
        self.shaft
    }

    /// The way from the last reading to this one, the shorter of the two.
    fn shortest(&self, raw: u32) -> i64 {
        let forward = if raw >= self.last {
            u64::from(raw - self.last)
        } else {
            (self.modulus + u64::from(raw)).saturating_sub(u64::from(self.last))
        };
        let forward = i64::try_from(forward).unwrap_or(0);
        let modulus = i64::try_from(self.modulus).unwrap_or(i64::MAX);
        if forward.saturating_mul(2) > modulus { forward - modulus } else { forward }
    }

    fn advance(&mut self, delta: i64) {
        let per_revolution = i64::from(self.per_revolution.get());
        let step = i64::from(self.shaft.step) + delta;
        let turns = div_floor(step, self.per_revolution);
        self.shaft.turns = self.shaft.turns.saturating_add(turns);
        self.shaft.step = u32::try_from(step - turns * per_revolution).unwrap_or(0);
    }
}

/// Division rounded towards minus infinity, by a divisor that cannot be zero.
fn div_floor(value: i64, divisor: NonZeroU32) -> i64 {
    let divisor = core::num::NonZeroU64::from(divisor);
    let quotient = |n: u64| i64::try_from(n / divisor).unwrap_or(i64::MAX);
    if value >= 0 { quotient(value.unsigned_abs()) } else { -quotient(value.unsigned_abs() - 1) - 1 }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn total(shaft: Shaft, per_revolution: u32) -> i64 {
        shaft.turns * i64::from(per_revolution) + i64::from(shaft.step)
    }

    proptest! {
        /// Against a plain sum of the movements.
        #[test]
        fn follows_any_movement_below_half_the_counter(
            per_revolution in 1..100_000_u32,
            modulus in 3..=u32::MAX,
            moves in prop::collection::vec(-1.0..1.0_f64, 1..50),
        ) {
            let steps = NonZeroU32::new(per_revolution).unwrap();
            let mut tracker = Tracker::new(steps, modulus, 0, Shaft::default());
            let mut position = 0_i64;
            for fraction in moves {
                position += (fraction * f64::from((modulus - 1) / 2)) as i64;
                let raw = u32::try_from(position.rem_euclid(i64::from(modulus))).unwrap();
                let shaft = tracker.update(raw);
                prop_assert_eq!(total(shaft, per_revolution), position);
                prop_assert!(shaft.step < per_revolution);
            }
        }

        /// A counter may hold any word, also one outside its own modulus.
        #[test]
        fn any_reading_leaves_a_step_inside_the_revolution(
            per_revolution in 1..=u32::MAX, modulus: u32, words in prop::collection::vec(any::<u32>(), 1..20),
        ) {
            let steps = NonZeroU32::new(per_revolution).unwrap();
            let mut tracker = Tracker::new(steps, modulus, 0, Shaft { turns: 0, step: u32::MAX });
            for word in words {
                prop_assert!(tracker.update(word).step < per_revolution);
            }
        }
    }

    #[test]
    fn a_counter_of_32_bits_wraps_both_ways() {
        let steps = NonZeroU32::new(4096).unwrap();
        let mut tracker = Tracker::new(steps, 0, u32::MAX, Shaft { turns: 5, step: 4095 });
        assert_eq!(tracker.update(0), Shaft { turns: 6, step: 0 });
        assert_eq!(tracker.update(u32::MAX - 1), Shaft { turns: 5, step: 4094 });
    }
}
