//! Implausible readings of an absolute encoder: positions that the shaft cannot have reached.
//!
//! A reading further from the last good one than the sensor can move is rejected. The time for which the new position
//! lasts proves nothing, because a code that has jumped stays where it is. The expected position is therefore followed
//! instead: it moves by the same steps as the rejected readings. Readings are accepted again when they are back at the
//! expected position. If the cause was too fast a movement and not a jump, only a preset or reference ends the
//! rejection.

/// State while readings are rejected.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImplausibleReadings {
    /// Number of bits of a reading that the code does not use.
    unused: u32,
    /// The last reading.
    word: u32,
    /// The reading expected at the position that the shaft should have.
    expected: u32,
    /// The last movement that was possible.
    step: i32,
    /// The readings have jumped away and may jump back.
    has_jumped: bool,
    /// Milliseconds since the first rejected reading, and one.
    millis: u32,
}

impl ImplausibleReadings {
    /// Starts with the reading `word` after the good one `last`, when the sensor moved `step` in a millisecond.
    pub(super) fn new(bits: u32, last: u32, step: i32, word: u32, fastest: u32) -> ImplausibleReadings {
        let unused = 32 - bits.clamp(1, 32);
        let expected = last.wrapping_add_signed(step);
        let away = between(expected, word, unused);
        ImplausibleReadings {
            unused,
            word,
            expected,
            step,
            has_jumped: away.unsigned_abs() > fastest,
            millis: 1,
        }
    }

    /// The last reading.
    pub(super) fn word(&self) -> u32 {
        self.word
    }

    /// Milliseconds since the last reading that was accepted.
    pub(super) fn millis(&self) -> u32 {
        self.millis
    }

    /// Counts a millisecond without a reading.
    pub(super) fn skip(&mut self) {
        self.millis = self.millis.saturating_add(1);
        self.expected = self.expected.wrapping_add_signed(self.step);
    }

    /// Takes a reading. Returns whether readings can be accepted again.
    pub(super) fn is_back(&mut self, word: u32, fastest: u32) -> bool {
        let moved = between(self.word, word, self.unused);
        if moved.unsigned_abs() <= fastest {
            self.step = moved;
        }
        self.expected = self.expected.wrapping_add_signed(self.step);
        self.word = word;
        self.millis = self.millis.saturating_add(1);
        self.has_jumped && between(self.expected, word, self.unused).unsigned_abs() <= fastest
    }
}

/// Steps from one reading to another, the shorter way.
fn between(from: u32, to: u32, unused: u32) -> i32 {
    (to.wrapping_sub(from) << unused).cast_signed() >> unused
}

#[cfg(test)]
mod tests {
    use super::*;

    const FASTEST: u32 = 1000;

    fn jumped(step: i32) -> ImplausibleReadings {
        ImplausibleReadings::new(25, 0, step, 4096, FASTEST)
    }

    #[test]
    fn a_code_that_stays_away_is_never_believed() {
        let mut implausible = jumped(0);
        assert!((0..100_000).all(|_| !implausible.is_back(4096, FASTEST)));
    }

    #[test]
    fn a_code_that_moves_on_in_the_wrong_place_is_not_believed() {
        for step in [1, -7, 900, -900] {
            let (mut implausible, mut word) = (jumped(step), 4096_u32);
            for _ in 0..10_000 {
                word = word.wrapping_add_signed(step);
                assert!(!implausible.is_back(word & 0x1FF_FFFF, FASTEST), "{word} at {step}");
            }
        }
    }

    #[test]
    fn a_code_that_jumps_back_is_believed_though_the_shaft_has_turned_on() {
        for step in [0, 1, -7, 900, -900] {
            let (mut implausible, mut shaft) = (jumped(step), step);
            for _ in 0..50 {
                shaft += step;
                assert!(!implausible.is_back((shaft + 4096).cast_unsigned() & 0x1FF_FFFF, FASTEST));
            }
            assert!(implausible.is_back((shaft + step).cast_unsigned() & 0x1FF_FFFF, FASTEST), "{step}");
        }
    }

    #[test]
    fn a_too_fast_movement_is_not_trusted_again_without_a_request() {
        let mut implausible = ImplausibleReadings::new(25, 0, 900, 1001, FASTEST);
        assert!((2..100).all(|n| !implausible.is_back(1001 * n, FASTEST)));
    }
}
