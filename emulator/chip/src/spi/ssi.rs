//! An absolute encoder with an SSI output on MISO, on the same shaft as the incremental encoder.
//!
//! The line is high at rest. The first edge of the clock latches the position. The first sampled bit is still the rest
//! level; then the word follows, most significant bit first. Afterwards the line is low until the clock has paused for
//! the monoflop time.

use canbus::Time;

/// Pause of the clock after which the encoder is ready for a new word.
const MONOFLOP: Time = Time::from_micros(20);

/// The format of the word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SsiFormat {
    /// Bits of the position within a revolution.
    pub single_turn: u32,
    /// Bits of the number of revolutions.
    pub multi_turn: u32,
    /// Whether the word is in Gray code instead of binary.
    pub gray: bool,
}

impl Default for SsiFormat {
    /// The common 25-bit multi-turn encoder in Gray code.
    fn default() -> Self {
        Self { single_turn: 13, multi_turn: 12, gray: true }
    }
}

/// The state of the encoder's serial output.
#[derive(Clone, Debug)]
pub(crate) struct Ssi {
    format: SsiFormat,
    /// The word under way and the number of bits sent, the rest level included.
    word: u64,
    sent: u32,
    last_clock: Option<Time>,
}

impl Ssi {
    pub(crate) fn new(format: SsiFormat) -> Self {
        Self { format, word: 0, sent: 0, last_clock: None }
    }

    /// Clocks `bits` bits out from `start` on, with the encoder at `position`, in revolutions.
    pub(crate) fn clock_out(&mut self, bits: u32, start: Time, bit: Time, position: f64) -> u32 {
        let rested = self.last_clock.is_none_or(|last| start.since(last) >= MONOFLOP);
        if rested {
            self.word = self.encode(position);
            self.sent = 0;
        }
        self.last_clock = Some(start + Time(bit.0 * u64::from(bits)));
        (0..bits).fold(0, |frame, _| frame << 1 | u32::from(self.next_bit()))
    }

    fn next_bit(&mut self) -> bool {
        let length = self.format.single_turn + self.format.multi_turn;
        let place = self.sent;
        self.sent = self.sent.saturating_add(1);
        match place {
            0 => true,
            _ if place <= length => self.word >> (length - place) & 1 != 0,
            _ => false,
        }
    }

    fn encode(&self, revolutions: f64) -> u64 {
        let SsiFormat { single_turn, multi_turn, gray } = self.format;
        let steps = (revolutions * (1_u64 << single_turn) as f64).floor() as i64;
        let binary = steps.rem_euclid(1 << (single_turn + multi_turn)) as u64;
        if gray { binary ^ binary >> 1 } else { binary }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: Time = Time::from_micros(1);

    #[test]
    fn a_word_goes_over_several_frames() {
        let format = SsiFormat { single_turn: 13, multi_turn: 12, gray: false };
        let mut ssi = Ssi::new(format);
        let first = ssi.clock_out(16, Time::from_millis(1), BIT, 5.25);
        let second = ssi.clock_out(16, Time::from_micros(1016), BIT, 5.25);
        let word = first << 16 | second;
        assert_eq!(word >> 31, 1, "the rest level");
        assert_eq!(word >> 6 & 0x1FF_FFFF, 5 << 13 | 2048);
        assert_eq!(word & 0x3F, 0, "low after the word");
    }

    #[test]
    fn the_position_is_latched_until_the_clock_rests() {
        let mut ssi = Ssi::new(SsiFormat { single_turn: 8, multi_turn: 0, gray: false });
        let read = |ssi: &mut Ssi, micros| {
            let start = Time::from_micros(micros);
            ssi.clock_out(16, start, BIT, start.as_secs_f64()) >> 7 & 0xFF
        };
        assert_eq!(read(&mut ssi, 500_000), 128);
        assert_eq!(read(&mut ssi, 500_020), 0, "still the old word, all sent");
        assert_eq!(read(&mut ssi, 750_000), 192);
    }

    #[test]
    fn in_gray_code_neighbours_differ_in_one_bit() {
        let ssi = Ssi::new(SsiFormat::default());
        let step = 1.0 / 8192.0;
        for n in [0.0, 1.0, 4095.0, 8191.0] {
            let difference = ssi.encode(n * step) ^ ssi.encode((n + 1.0) * step);
            assert_eq!(difference.count_ones(), 1, "{n}");
        }
    }
}
