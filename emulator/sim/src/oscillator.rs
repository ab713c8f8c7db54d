//! The error of a board's oscillator.

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
}
