//! An absolute encoder with an SSI output on MISO, on the same shaft as the incremental encoder.
//!
//! The line is high at rest. The first edge of the clock latches the position. The first sampled bit is still the rest
//! level; then the word follows, most significant bit first. Afterwards the line is low until the clock has paused for
//! the monoflop time.

use std::fmt;
use std::str::FromStr;

use canbus::Time;
use thiserror::Error;

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
    /// Whether an error bit follows the position.
    pub error_bit: bool,
    /// The parity bit at the end of the word.
    pub parity: Option<Parity>,
}

/// The parity over the whole word, its own bit included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parity {
    /// An even number of ones.
    Even,
    /// An odd number of ones.
    Odd,
}

/// The text of a format is wrong.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "`{0}` is no format of an absolute encoder, such as 12+13,gray,error,even: turns + steps in bits (32 at most), then gray or binary, error, even or odd"
)]
pub struct SsiFormatError(String);

impl FromStr for SsiFormat {
    type Err = SsiFormatError;

    /// `TURNS+STEPS[,gray|binary][,error][,even|odd]`, each property once.
    fn from_str(text: &str) -> Result<Self, SsiFormatError> {
        let wrong = || SsiFormatError(text.to_owned());
        let mut parts = text.split(',').map(str::trim);
        let (turns, steps) = parts.next().and_then(|bits| bits.split_once('+')).ok_or_else(wrong)?;
        let bits = |text: &str| text.trim().parse().map_err(|_| wrong());
        let (multi_turn, single_turn): (u32, u32) = (bits(turns)?, bits(steps)?);
        let is_possible = (1..=31).contains(&single_turn) && multi_turn <= 32 - single_turn;
        let plain = Self { single_turn, multi_turn, error_bit: false, parity: None, ..Self::default() };
        let start = is_possible.then_some(plain).ok_or_else(wrong)?;
        let mut given = Vec::new();
        parts.try_fold(start, |format, part| {
            let (property, format) = match part {
                "gray" => ("coding", Self { gray: true, ..format }),
                "binary" => ("coding", Self { gray: false, ..format }),
                "error" => ("error", Self { error_bit: true, ..format }),
                "even" => ("parity", Self { parity: Some(Parity::Even), ..format }),
                "odd" => ("parity", Self { parity: Some(Parity::Odd), ..format }),
                _ => return Err(wrong()),
            };
            if given.contains(&property) {
                return Err(wrong());
            }
            given.push(property);
            Ok(format)
        })
    }
}

/// The text form that `from_str` reads.
impl fmt::Display for SsiFormat {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { single_turn, multi_turn, gray, error_bit, parity } = *self;
        let coding = if gray { "gray" } else { "binary" };
        let error = if error_bit { ",error" } else { "" };
        let parity = match parity {
            None => "",
            Some(Parity::Even) => ",even",
            Some(Parity::Odd) => ",odd",
        };
        write!(f, "{multi_turn}+{single_turn},{coding}{error}{parity}")
    }
}

/// The encoder at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reading {
    /// The position in revolutions.
    pub(crate) revolutions: f64,
    /// The encoder reports an error of its own.
    pub(crate) has_error: bool,
    /// The parity bit is wrong.
    pub(crate) is_disturbed: bool,
}

impl Default for SsiFormat {
    /// The common 25-bit multi-turn encoder in Gray code.
    fn default() -> Self {
        Self { single_turn: 13, multi_turn: 12, gray: true, error_bit: false, parity: None }
    }
}

impl SsiFormat {
    /// The bits of the word.
    fn length(&self) -> u32 {
        self.single_turn + self.multi_turn + u32::from(self.error_bit) + u32::from(self.parity.is_some())
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

    /// Another encoder.
    pub(crate) fn set_format(&mut self, format: SsiFormat) {
        self.format = format;
    }

    /// Clocks `bits` bits out from `start` on.
    pub(crate) fn clock_out(&mut self, bits: u32, start: Time, bit: Time, reading: Reading) -> u32 {
        let rested = self.last_clock.is_none_or(|last| start.since(last) >= MONOFLOP);
        if rested {
            self.word = self.encode(reading);
            self.sent = 0;
        }
        self.last_clock = Some(start + Time(bit.0 * u64::from(bits)));
        (0..bits).fold(0, |frame, _| frame << 1 | u32::from(self.next_bit()))
    }

    fn next_bit(&mut self) -> bool {
        let length = self.format.length();
        let place = self.sent;
        self.sent = self.sent.saturating_add(1);
        match place {
            0 => true,
            _ if place <= length => self.word >> (length - place) & 1 != 0,
            _ => false,
        }
    }

    fn encode(&self, reading: Reading) -> u64 {
        let SsiFormat { single_turn, multi_turn, gray, error_bit, parity } = self.format;
        let steps = (reading.revolutions * (1_u64 << single_turn) as f64).floor() as i64;
        let binary = steps.rem_euclid(1 << (single_turn + multi_turn)) as u64;
        let mut word = if gray { binary ^ binary >> 1 } else { binary };
        if error_bit {
            word = word << 1 | u64::from(reading.has_error);
        }
        if let Some(parity) = parity {
            let is_odd = word.count_ones() % 2 == 1;
            let right = is_odd == (parity == Parity::Even);
            word = word << 1 | u64::from(right != reading.is_disturbed);
        }
        word
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: Time = Time::from_micros(1);

    fn at(revolutions: f64) -> Reading {
        Reading { revolutions, ..Reading::default() }
    }

    #[test]
    fn a_word_goes_over_several_frames() {
        let format = SsiFormat { gray: false, ..SsiFormat::default() };
        let mut ssi = Ssi::new(format);
        let first = ssi.clock_out(16, Time::from_millis(1), BIT, at(5.25));
        let second = ssi.clock_out(16, Time::from_micros(1016), BIT, at(5.25));
        let word = first << 16 | second;
        assert_eq!(word >> 31, 1, "the rest level");
        assert_eq!(word >> 6 & 0x1FF_FFFF, 5 << 13 | 2048);
        assert_eq!(word & 0x3F, 0, "low after the word");
    }

    #[test]
    fn a_format_has_each_property_once() {
        for text in
            ["12+13,gray,binary", "12+13,gray,gray", "12+13,error,error", "12+13,even,odd", "12+13,odd,odd"]
        {
            assert!(text.parse::<SsiFormat>().is_err(), "{text}");
        }
        for text in ["12+13", "12+13,odd", "0+8,binary,error,even", "12+13,error,gray"] {
            assert!(text.parse::<SsiFormat>().is_ok(), "{text}");
        }
    }

    #[test]
    fn the_position_is_latched_until_the_clock_rests() {
        let mut ssi =
            Ssi::new(SsiFormat { single_turn: 8, multi_turn: 0, gray: false, ..SsiFormat::default() });
        let read = |ssi: &mut Ssi, micros| {
            let start = Time::from_micros(micros);
            ssi.clock_out(16, start, BIT, at(start.as_secs_f64())) >> 7 & 0xFF
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
            let difference = ssi.encode(at(n * step)) ^ ssi.encode(at((n + 1.0) * step));
            assert_eq!(difference.count_ones(), 1, "{n}");
        }
    }

    #[test]
    fn error_and_parity_follow_the_position() {
        let format: SsiFormat = "0+4,binary,error,odd".parse().unwrap();
        let ssi = Ssi::new(format);
        assert_eq!(format.length(), 6);
        // Three steps of 16 in four bits, then the error bit and the parity.
        let three = Reading { revolutions: 3.0 / 16.0, ..Reading::default() };
        assert_eq!(ssi.encode(three), 0b00_1101);
        assert_eq!(ssi.encode(Reading { has_error: true, ..three }), 0b00_1110);
        assert_eq!(ssi.encode(Reading { is_disturbed: true, ..three }), 0b00_1100);
    }

    #[test]
    fn a_format_has_a_text() {
        for text in ["12+13,gray", "0+24,binary,error,even", "8+16,binary,odd"] {
            assert_eq!(text.parse::<SsiFormat>().unwrap().to_string(), text);
        }
        assert_eq!("12+13".parse(), Ok(SsiFormat::default()));
        for text in ["", "13", "12+", "12+32", "20+13", "0+0", "12+13,grey"] {
            assert!(text.parse::<SsiFormat>().is_err(), "{text}");
        }
    }
}
