//! The frame of an absolute encoder with synchronous serial interface.
//!
//! At rest the line is high; the first clock latches the position. The first bit that is clocked in is the rest level.
//! The word follows with the most significant bit first: revolutions, steps, then an alarm bit and a parity bit if the
//! encoder has them. After the word the line is low until the clock has rested for the monoflop time. The levels before
//! and after the word distinguish an encoder from an open or shorted line.

use crate::board::SsiFrame;

/// Coding of the position on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Plain binary.
    Binary,
    /// Gray code over revolutions and steps together.
    Gray,
}

/// The parity bit that ends the word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parity {
    /// No parity bit.
    None,
    /// The number of ones, parity bit included, is even.
    Even,
    /// The number of ones, parity bit included, is odd.
    Odd,
}

/// The layout of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    revolution_bits: u8,
    step_bits: u8,
    coding: Coding,
    alarm: bool,
    parity: Parity,
    /// The bit before the word: the rest level.
    head: u64,
}

/// Content of a valid word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Revolutions and steps as one number: the steps are its low bits.
    pub position: u32,
    /// The same number as coded on the line.
    pub code: u32,
    /// The encoder's own alarm bit.
    pub alarm: bool,
}

/// Why a frame gives no position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The line was not high before the word or not low after it. The line is open or shorted, the encoder has no
    /// power, or its word is longer than the format says.
    NoSignal,
    /// The parity bit is wrong: the line is disturbed or shorted.
    Parity,
}

impl Format {
    /// 4096 revolutions of 8192 steps in Gray code: the most common format of multi-turn encoders.
    pub const COMMON: Format = Format {
        revolution_bits: 12,
        step_bits: 13,
        coding: Coding::Gray,
        alarm: false,
        parity: Parity::None,
        head: 1 << 25,
    };

    /// A layout; `None` for no step bits, for more than 31 step bits (6501h is an UNSIGNED32), or for more than 32
    /// position bits.
    #[must_use]
    pub fn new(
        revolution_bits: u8,
        step_bits: u8,
        coding: Coding,
        alarm: bool,
        parity: Parity,
    ) -> Option<Format> {
        let bits = revolution_bits.checked_add(step_bits).filter(|bits| *bits <= 32)?;
        let length = u32::from(bits) + u32::from(alarm) + u32::from(parity != Parity::None);
        let format = Format { revolution_bits, step_bits, coding, alarm, parity, head: 1 << length };
        (1..=31).contains(&step_bits).then_some(format)
    }

    /// Number of bits on the line.
    #[must_use]
    pub fn length(self) -> u32 {
        self.head.trailing_zeros()
    }

    /// Number of bits of the position within a revolution.
    #[must_use]
    pub fn step_bits(self) -> u32 {
        self.step_bits.into()
    }

    /// Number of revolution bits.
    #[must_use]
    pub fn revolution_bits(self) -> u32 {
        self.revolution_bits.into()
    }

    /// Number of bits of the position, 32 at most.
    #[must_use]
    pub fn position_bits(self) -> u32 {
        self.revolution_bits() + self.step_bits()
    }

    /// Reads a frame.
    ///
    /// # Errors
    /// [`Fault`] when the line or the parity is bad.
    pub fn read(self, frame: SsiFrame) -> Result<Reading, Fault> {
        let Some(tail) = frame.clocks.min(64).checked_sub(self.length() + 1).filter(|tail| *tail > 0) else {
            return Err(Fault::NoSignal);
        };
        let word = frame.bits >> tail;
        let is_high_before = word & self.head != 0;
        let is_low_after = frame.bits.trailing_zeros() >= tail;
        if is_high_before && is_low_after { self.decode(word) } else { Err(Fault::NoSignal) }
    }

    /// Reads a word, right-aligned; bits above its length are ignored.
    ///
    /// # Errors
    /// [`Fault::Parity`].
    pub fn decode(self, word: u64) -> Result<Reading, Fault> {
        let word = word & (self.head - 1);
        let is_odd = || word.count_ones() % 2 == 1;
        let rest = match self.parity {
            Parity::None => word,
            Parity::Even if is_odd() => return Err(Fault::Parity),
            Parity::Odd if !is_odd() => return Err(Fault::Parity),
            Parity::Even | Parity::Odd => word >> 1,
        };
        let (alarm, code) = if self.alarm { (rest & 1 == 1, rest >> 1) } else { (false, rest) };
        let code = low_word(code);
        let position = if self.coding == Coding::Gray { from_gray(code) } else { code };
        Ok(Reading { position, code, alarm })
    }
}

/// A position has at most 32 bits.
#[allow(clippy::cast_possible_truncation)]
fn low_word(code: u64) -> u32 {
    code as u32
}

/// Each bit is the exclusive or of all Gray bits from the highest down to the same place.
fn from_gray(mut code: u32) -> u32 {
    for shift in [16, 8, 4, 2, 1] {
        code ^= code >> shift;
    }
    code
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn encode(format: Format, position: u32, alarm: bool) -> u64 {
        let code = if format.coding == Coding::Gray { position ^ (position >> 1) } else { position };
        let mut word = u64::from(code);
        if format.alarm {
            word = word << 1 | u64::from(alarm);
        }
        let odd = word.count_ones() % 2 == 1;
        match format.parity {
            Parity::None => word,
            Parity::Even => word << 1 | u64::from(odd),
            Parity::Odd => word << 1 | u64::from(!odd),
        }
    }

    fn any_format() -> impl Strategy<Value = Format> {
        let coding = prop_oneof![Just(Coding::Binary), Just(Coding::Gray)];
        let parity = prop_oneof![Just(Parity::None), Just(Parity::Even), Just(Parity::Odd)];
        (0..=16_u8, 1..=16_u8, coding, any::<bool>(), parity).prop_map(
            |(turns, steps, coding, alarm, parity)| Format::new(turns, steps, coding, alarm, parity).unwrap(),
        )
    }

    fn frame(format: Format, position: u32, alarm: bool, tail: u32) -> SsiFrame {
        let bits = (1 << format.length() | encode(format, position, alarm)) << tail;
        SsiFrame { bits, clocks: 1 + format.length() + tail }
    }

    proptest! {
        #[test]
        fn words_of_an_encoder_decode(format in any_format(), raw: u32, alarm: bool, tail in 1..=28_u32) {
            let position = raw & u32::MAX >> (32 - format.position_bits());
            let reading = format.read(frame(format, position, alarm, tail)).unwrap();
            prop_assert_eq!((reading.position, reading.alarm), (position, alarm && format.alarm));
        }

        #[test]
        fn one_wrong_bit_breaks_the_parity(format in any_format(), raw: u32, bit in 0..34_u32) {
            prop_assume!(format.parity != Parity::None && bit < format.length());
            let position = raw & u32::MAX >> (32 - format.position_bits());
            let word = encode(format, position, false) ^ (1 << bit);
            prop_assert_eq!(format.decode(word), Err(Fault::Parity));
        }

        #[test]
        fn any_frame_is_read_or_refused(format in any_format(), bits: u64, clocks: u32) {
            if let Ok(reading) = format.read(SsiFrame { bits, clocks }) {
                prop_assert!(u64::from(reading.position) < 1 << format.position_bits());
            }
        }

        #[test]
        fn a_dead_line_is_no_position(format in any_format(), clocks in 0..=64_u32) {
            for bits in [0, u64::MAX] {
                prop_assert_eq!(format.read(SsiFrame { bits, clocks }), Err(Fault::NoSignal));
            }
        }
    }

    #[test]
    fn a_bit_after_the_word_is_noticed() {
        let long = Format::new(12, 14, Coding::Gray, false, Parity::None).unwrap();
        assert_eq!(Format::COMMON.read(frame(long, 1, false, 5)), Err(Fault::NoSignal));
        assert!(long.read(frame(long, 1, false, 5)).is_ok());
    }

    #[test]
    fn refuses_layouts_that_fit_no_position() {
        assert_eq!(Format::new(0, 0, Coding::Binary, false, Parity::None), None);
        assert_eq!(Format::new(20, 13, Coding::Binary, false, Parity::None), None);
        assert_eq!(Format::new(0, 32, Coding::Binary, false, Parity::None), None);
        assert!(Format::new(16, 16, Coding::Binary, true, Parity::Odd).is_some());
    }
}
