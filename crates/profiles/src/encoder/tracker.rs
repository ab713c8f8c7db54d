//! Position of the shaft, counted without end.

use core::num::{NonZeroU32, NonZeroU64};

/// A mechanical position in native steps: whole turns since some origin, and the step within one.
///
/// A turn is a revolution of a rotary encoder; for a linear encoder, see [`Scale::turn`](super::Scale::turn).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShaftPosition {
    /// Whole turns, negative below the origin.
    pub turns: i64,
    /// Native step within the turn, below the steps per turn.
    pub step: u32,
}

impl ShaftPosition {
    /// The shaft at `total` steps from its origin.
    #[must_use]
    pub fn at(total: i64, turn: NonZeroU32) -> ShaftPosition {
        let turns = div_floor(total, turn);
        ShaftPosition { turns, step: remainder(total, turns, turn) }
    }

    /// Steps from the origin, modulo 2^64.
    #[must_use]
    pub fn total(self, turn: NonZeroU32) -> i64 {
        self.turns.wrapping_mul(turn.get().into()).wrapping_add(self.step.into())
    }
}

/// Follows a counter that wraps (a 16-bit timer, a single-turn or multi-turn word) without losing turns.
///
/// Between two readings the shaft may move less than half of the counter's range; a faster shaft looks like a slower
/// one in the other direction, as with every counter.
#[derive(Clone, Copy, Debug)]
pub struct Tracker {
    turn: NonZeroU32,
    /// Number of bits of a word that the counter does not use.
    unused: u32,
    word: u32,
    shaft: ShaftPosition,
    count: u32,
}

impl Tracker {
    /// A counter of `bits` bits, 1 to 32, that reads `word` while the shaft is `total` steps from its origin.
    #[must_use]
    pub fn new(turn: NonZeroU32, bits: u32, word: u32, total: i64) -> Tracker {
        Tracker {
            turn,
            unused: 32 - bits.clamp(1, 32),
            word,
            shaft: ShaftPosition::at(total, turn),
            count: 0,
        }
    }

    /// Steps from the last reading to this one, the shorter way.
    #[must_use]
    pub fn distance(&self, word: u32) -> i32 {
        (word.wrapping_sub(self.word) << self.unused).cast_signed() >> self.unused
    }

    /// Takes a reading; returns the steps moved.
    pub fn follow(&mut self, word: u32) -> i32 {
        let moved = self.distance(word);
        self.advance(word, moved);
        moved
    }

    /// Takes a reading after a movement by `moved` steps, which may be longer than half of the counter's range.
    #[inline]
    pub(super) fn advance(&mut self, word: u32, moved: i32) {
        self.word = word;
        self.count = self.count.wrapping_add_signed(moved);
        match self.shaft.step.checked_add_signed(moved) {
            Some(step) if step < self.turn.get() => self.shaft.step = step,
            _ => self.correct(moved.into()),
        }
    }

    /// Corrects the position without a movement.
    pub fn correct(&mut self, steps: i64) {
        let step = i64::from(self.shaft.step).wrapping_add(steps);
        let turn = i64::from(self.turn.get());
        // A shaft turns less than once in a sample, so the division is hardly ever needed.
        let turns = match step {
            _ if step < -turn || step >= 2 * turn => div_floor(step, self.turn),
            _ if step < 0 => -1,
            _ => i64::from(step >= turn),
        };
        self.shaft.turns = self.shaft.turns.wrapping_add(turns);
        self.shaft.step = remainder(step, turns, self.turn);
    }

    /// Counts in turns of another length from now on.
    pub fn set_turn(&mut self, turn: NonZeroU32) {
        if turn != self.turn {
            self.shaft = ShaftPosition::at(self.total(), turn);
            self.turn = turn;
        }
    }

    /// Position of the shaft at the last reading.
    #[must_use]
    pub fn shaft(&self) -> ShaftPosition {
        self.shaft
    }

    /// Steps from the origin at the last reading.
    #[must_use]
    pub fn total(&self) -> i64 {
        self.shaft.total(self.turn)
    }

    /// The step within a turn of this length. No division is needed if the tracker counts in that length.
    #[must_use]
    pub fn step_in(&self, turn: NonZeroU32) -> u32 {
        if turn == self.turn { self.shaft.step } else { ShaftPosition::at(self.total(), turn).step }
    }

    /// The last reading.
    #[must_use]
    pub fn word(&self) -> u32 {
        self.word
    }

    /// All movement since the start, in steps modulo 2^32, without corrections.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }
}

/// Division rounded towards minus infinity.
#[inline(never)]
fn div_floor(value: i64, divisor: NonZeroU32) -> i64 {
    let divisor = NonZeroU64::from(divisor);
    let quotient = |n: u64| i64::try_from(n / divisor).unwrap_or(i64::MAX);
    if value >= 0 { quotient(value.unsigned_abs()) } else { -quotient(value.unsigned_abs() - 1) - 1 }
}

/// Remainder of `value` after `turns` turns, less than one turn.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn remainder(value: i64, turns: i64, turn: NonZeroU32) -> u32 {
    value.wrapping_sub(turns.wrapping_mul(turn.get().into())) as u32
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TEN: NonZeroU32 = NonZeroU32::new(10).unwrap();

    #[test]
    fn a_step_is_never_negative() {
        for (total, turns, step) in
            [(0, 0, 0), (9, 0, 9), (10, 1, 0), (-1, -1, 9), (-10, -1, 0), (-11, -2, 9), (-20, -2, 0)]
        {
            assert_eq!(ShaftPosition::at(total, TEN), ShaftPosition { turns, step }, "{total}");
            let mut tracker = Tracker::new(TEN, 16, 0, 0);
            tracker.correct(total);
            assert_eq!(tracker.shaft(), ShaftPosition { turns, step }, "{total}");
        }
    }

    #[test]
    fn a_tracker_measures_the_step_in_turns_of_any_length() {
        let mut tracker = Tracker::new(TEN, 16, 1000, 25);
        assert_eq!((tracker.step_in(TEN), tracker.step_in(NonZeroU32::new(7).unwrap())), (5, 4));
        tracker.follow(1002);
        assert_eq!((tracker.word(), tracker.total(), tracker.count()), (1002, 27, 2));
    }

    proptest! {
        /// Compares with a plain sum of the movements.
        #[test]
        fn follows_any_movement_below_half_the_counter(
            turn in 1..=u32::MAX, bits in 2..=32_u32, start in -(1_i64 << 60)..1 << 60,
            moves in prop::collection::vec(-1.0..1.0_f64, 1..50),
        ) {
            let turn = NonZeroU32::new(turn).unwrap();
            let word = |total: i64| u32::try_from(total.rem_euclid(1 << bits)).unwrap();
            let mut tracker = Tracker::new(turn, bits, word(start), start);
            let mut total = start;
            for fraction in moves {
                total += (fraction * f64::from((1_u32 << (bits - 1)) - 1)) as i64;
                tracker.follow(word(total));
                prop_assert_eq!(tracker.total(), total);
                prop_assert!(tracker.shaft().step < turn.get());
                prop_assert_eq!(tracker.count(), total.wrapping_sub(start) as u32);
            }
        }

        #[test]
        fn anything_leaves_a_step_inside_the_turn(
            turn in 1..=u32::MAX, other in 1..=u32::MAX, bits: u32, start: i64,
            words in prop::collection::vec(any::<u32>(), 1..20), corrections in prop::collection::vec(any::<i64>(), 1..20),
        ) {
            let turn = NonZeroU32::new(turn).unwrap();
            let mut tracker = Tracker::new(turn, bits, 0, start);
            for word in words {
                tracker.follow(word);
                prop_assert!(tracker.shaft().step < turn.get());
            }
            for steps in corrections {
                tracker.correct(steps);
                prop_assert!(tracker.shaft().step < turn.get());
            }
            tracker.set_turn(NonZeroU32::new(other).unwrap());
            prop_assert!(tracker.shaft().step < other);
        }
    }

    #[test]
    fn a_counter_of_32_bits_wraps_both_ways() {
        let turn = NonZeroU32::new(4096).unwrap();
        let mut tracker = Tracker::new(turn, 32, u32::MAX, 5 * 4096 + 4095);
        assert_eq!(tracker.follow(0), 1);
        assert_eq!(tracker.shaft(), ShaftPosition { turns: 6, step: 0 });
        assert_eq!(tracker.follow(u32::MAX - 1), -2);
        assert_eq!(tracker.shaft(), ShaftPosition { turns: 5, step: 4094 });
    }

    #[test]
    fn a_correction_is_no_movement() {
        let turn = NonZeroU32::new(100).unwrap();
        let mut tracker = Tracker::new(turn, 16, 0, 0);
        tracker.follow(30);
        tracker.correct(-40);
        assert_eq!((tracker.shaft(), tracker.count()), (ShaftPosition { turns: -1, step: 90 }, 30));
        tracker.follow(35);
        assert_eq!(tracker.total(), -5);
    }
}
