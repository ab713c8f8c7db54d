//! Debouncing of contacts.

/// Number of consecutive samples that must agree before the input changes. At 1 kHz this is 10 ms: contacts bounce for
/// less, and no press of a button is shorter.
const SAMPLES: u8 = 10;

/// One input, sampled at a constant rate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Debounce {
    is_on: bool,
    /// Number of consecutive samples with the opposite state.
    other: u8,
}

impl Debounce {
    /// An input that is off until it has been on for long enough.
    #[must_use]
    pub const fn new() -> Debounce {
        Debounce { is_on: false, other: 0 }
    }

    /// Takes a sample and returns the debounced state.
    pub fn sample(&mut self, level: bool) -> bool {
        self.other = if level == self.is_on { 0 } else { self.other.saturating_add(1) };
        if self.other >= SAMPLES {
            *self = Debounce { is_on: level, other: 0 };
        }
        self.is_on
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(debounce: &mut Debounce, levels: impl IntoIterator<Item = bool>) -> Option<bool> {
        levels.into_iter().map(|level| debounce.sample(level)).last()
    }

    #[test]
    fn a_level_that_lasts_is_believed() {
        let mut input = Debounce::new();
        assert_eq!(after(&mut input, [true; 9]), Some(false));
        assert_eq!(after(&mut input, [true]), Some(true));
        assert_eq!(after(&mut input, [false; 9]), Some(true));
        assert_eq!(after(&mut input, [false]), Some(false));
    }

    #[test]
    fn bounces_are_not() {
        let mut input = Debounce::new();
        let bouncing = (0..1000).map(|n| n % 10 != 9);
        assert!(bouncing.clone().all(|level| !input.sample(level)));
        assert_eq!(after(&mut input, [true; 10]), Some(true));
        assert!(bouncing.map(|level| !level).all(|level| input.sample(level)));
    }
}
