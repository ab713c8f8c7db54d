//! The oscillators of a board: the error of the one at OSC_IN, and the frequency of the LSI.

use std::ops::RangeInclusive;
use std::str::FromStr;

/// Largest error in ppm: 2 %.
const MOST: i32 = 20_000;

/// The error of a board's oscillator in parts per million: positive is fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Oscillator(i32);

impl Oscillator {
    /// The frequency of the board's oscillator, with its nominal frequency.
    pub(crate) fn hertz(self, nominal: u32) -> Option<u64> {
        let nominal = u64::from(nominal);
        nominal.checked_add_signed(i64::try_from(nominal).ok()? * i64::from(self.0) / 1_000_000)
    }
}

impl FromStr for Oscillator {
    type Err = String;

    fn from_str(text: &str) -> Result<Oscillator, String> {
        let ppm = text.parse().ok().filter(|ppm: &i32| ppm.unsigned_abs() <= MOST.unsigned_abs());
        ppm.map(Oscillator)
            .ok_or_else(|| format!("{text:?} is no error of an oscillator: -{MOST} to {MOST} ppm"))
    }
}

/// The frequencies of the LSI in hertz (STM32F446 datasheet, LSI oscillator characteristics).
const LSI: RangeInclusive<u32> = 17_000..=47_000;

/// The frequency of a board's LSI, from which the watchdog counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lsi(u32);

impl Lsi {
    /// The frequency in hertz.
    pub(crate) const fn hertz(self) -> u32 {
        self.0
    }
}

impl FromStr for Lsi {
    type Err = String;

    fn from_str(text: &str) -> Result<Lsi, String> {
        let hertz = text.parse().ok().filter(|hertz| LSI.contains(hertz));
        hertz
            .map(Lsi)
            .ok_or_else(|| format!("{text:?} is no frequency of an LSI: {} to {} Hz", LSI.start(), LSI.end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_per_million_of_eight_megahertz() {
        let hertz = |text: &str| text.parse::<Oscillator>().unwrap().hertz(8_000_000);
        assert_eq!(
            (hertz("0"), hertz("50"), hertz("-3000")),
            (Some(8_000_000), Some(8_000_400), Some(7_976_000))
        );
        for text in ["", "fast", "20001", "-20001", "99999999999"] {
            assert!(text.parse::<Oscillator>().is_err(), "{text}");
        }
    }

    #[test]
    fn an_lsi_has_17_to_47_kilohertz() {
        assert_eq!("17000".parse::<Lsi>().map(Lsi::hertz), Ok(17_000));
        assert_eq!("47000".parse::<Lsi>().map(Lsi::hertz), Ok(47_000));
        for text in ["", "16999", "47001", "32 kHz"] {
            assert!(text.parse::<Lsi>().is_err(), "{text}");
        }
    }
}
