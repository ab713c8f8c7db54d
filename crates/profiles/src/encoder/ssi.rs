//! The word of an absolute encoder with synchronous serial interface.
//!
//! Most significant bit first: revolutions, steps, then an alarm bit and a parity bit where the encoder has them.

/// How the position is coded on the line.
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
    /// The encoder sends none.
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
}

/// What a good word says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Revolutions and steps as one number: the steps are its low bits.
    pub position: u32,
    /// The encoder's own alarm bit.
    pub alarm: bool,
}

/// Why a word is no position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Every bit is 1: the data line is open, or the encoder has no power.
    LineOpen,
    /// The parity bit does not fit: a disturbed or shorted line.
    Parity,
}

impl Format {
    /// A layout; `None` for no step bits or more than 32 position bits.
    #[must_use]
    pub fn new(
        revolution_bits: u8,
        step_bits: u8,
        coding: Coding,
        alarm: bool,
        parity: Parity,
    ) -> Option<Format> {
        let bits = revolution_bits.checked_add(step_bits)?;
        (step_bits > 0 && bits <= 32).then_some(Format { revolution_bits, step_bits, coding, alarm, parity })
    }

    /// Bits on the line.
    #[must_use]
    pub fn length(self) -> u32 {
        self.position_bits() + u32::from(self.alarm) + u32::from(self.parity != Parity::None)
    }

    /// Number of different positions, 2^32 at most.
    #[must_use]
    pub fn positions(self) -> u64 {
        1 << self.position_bits()
    }

    /// Reads a word, right-aligned; bits above its length are ignored.
    ///
    /// # Errors
    /// [`Fault`] when the line or the parity is bad.
    pub fn decode(self, word: u64) -> Result<Reading, Fault> {
        let word = word & self.mask();
        if word == self.mask() {
            return Err(Fault::LineOpen);
        }
        let odd = word.count_ones() % 2 == 1;
        let good = match self.parity {
            Parity::None => true,
            Parity::Even => !odd,
            Parity::Odd => odd,
        };
        if !good {
            return Err(Fault::Parity);
        }
        let rest = if self.parity == Parity::None { word } else { word >> 1 };
        let (alarm, code) = if self.alarm { (rest & 1 == 1, rest >> 1) } else { (false, rest) };
        let position = u32::try_from(code).unwrap_or(u32::MAX);
        Ok(Reading {
            position: if self.coding == Coding::Gray { from_gray(position) } else { position },
            alarm,
        })
    }

    fn position_bits(self) -> u32 {
        u32::from(self.revolution_bits) + u32::from(self.step_bits)
    }

    fn mask(self) -> u64 {
        (1 << self.length()) - 1
    }
}

/// Each bit is the exclusive or of all Gray bits from the top down to it.
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

    proptest! {
        #[test]
        fn decodes_what_an_encoder_sends(format in any_format(), raw: u32, alarm: bool) {
            let position = raw & u32::try_from(format.positions() - 1).unwrap();
            let word = encode(format, position, alarm);
            prop_assume!(word != (1 << format.length()) - 1);
            prop_assert_eq!(format.decode(word), Ok(Reading { position, alarm: alarm && format.alarm }));
        }

        #[test]
        fn one_wrong_bit_breaks_the_parity(format in any_format(), raw: u32, bit in 0..34_u32) {
            prop_assume!(format.parity != Parity::None && bit < format.length());
            let position = raw & u32::try_from(format.positions() - 1).unwrap();
            let word = encode(format, position, false) ^ (1 << bit);
            prop_assert!(format.decode(word).is_err());
        }

        #[test]
        fn any_word_is_read_or_refused(format in any_format(), word: u64) {
            if let Ok(reading) = format.decode(word) {
                prop_assert!(u64::from(reading.position) < format.positions());
            }
        }
    }

    #[test]
    fn an_open_line_is_no_position() {
        let format = Format::new(12, 13, Coding::Gray, false, Parity::None).unwrap();
        assert_eq!(format.decode(u64::MAX), Err(Fault::LineOpen));
    }

    #[test]
    fn refuses_layouts_that_fit_no_position() {
        assert_eq!(Format::new(0, 0, Coding::Binary, false, Parity::None), None);
        assert_eq!(Format::new(20, 13, Coding::Binary, false, Parity::None), None);
        assert!(Format::new(16, 16, Coding::Binary, true, Parity::Odd).is_some());
    }
}
