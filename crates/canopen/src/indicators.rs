//! The two indicators of a device: RUN, green, and ERROR, red (CiA 303-3).

use crate::Instant;

/// Times of CiA 303-3 in microseconds: of flickering, of all other flashes, and of the pause behind a group of flashes.
const FLICKER: u64 = 50_000;
const FLASH: u64 = 200_000;
const PAUSE: u64 = 1_000_000;

/// The pattern of an indicator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pattern {
    /// Off.
    Off,
    /// On.
    On,
    /// On and off every 50 ms. RUN and ERROR flicker alternately.
    Flickering,
    /// On and off every 200 ms.
    Blinking,
    /// A number of flashes of 200 ms, then a pause of 1 s.
    Flashes(u8),
}

impl Pattern {
    fn is_on(self, now: Instant) -> bool {
        match self {
            Pattern::Off => false,
            Pattern::On => true,
            Pattern::Flickering => (now.0 / FLICKER).is_multiple_of(2),
            Pattern::Blinking => (now.0 / FLASH).is_multiple_of(2),
            Pattern::Flashes(count) => {
                let flashes = 2 * FLASH * u64::from(count);
                let at = now.0 % (flashes + PAUSE - FLASH);
                at < flashes && (at / FLASH).is_multiple_of(2)
            }
        }
    }
}

/// The state of the CAN controller, as the indicators show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusHealth {
    /// Both error counters are below 96.
    Good,
    /// An error counter is at 96 or more.
    Warning,
    /// Bus-off.
    Off,
    /// The bit rate is being detected.
    Searching,
}

/// Both indicators: see [`Device::indicators`](crate::Device::indicators).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Indicators {
    /// The NMT state.
    pub run: Pattern,
    /// The worst present error.
    pub error: Pattern,
}

impl Indicators {
    /// The next instant at which a pattern may change: each change is at a multiple of 50 ms.
    #[must_use]
    pub fn next_change(now: Instant) -> Instant {
        Instant((now.0 / FLICKER + 1).saturating_mul(FLICKER))
    }

    /// Whether RUN and ERROR are on. To be asked again at [`next_change`](Indicators::next_change) at the latest, and where
    /// the state of the device changes.
    #[must_use]
    pub fn levels(&self, now: Instant) -> [bool; 2] {
        // Flickering begins with RUN.
        let turn = if self.error == Pattern::Flickering { FLICKER } else { 0 };
        [self.run.is_on(now), self.error.is_on(Instant(now.0.wrapping_add(turn)))]
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    /// The lengths of the phases in milliseconds, beginning with the first change.
    fn phases(pattern: Pattern) -> Vec<u64> {
        let is_on = |ms: u64| pattern.is_on(Instant(ms * 1000));
        let changes: Vec<u64> = (1..6000).filter(|ms| is_on(*ms) != is_on(ms - 1)).collect();
        changes.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    #[test]
    fn every_pattern_has_its_times() {
        assert_eq!(phases(Pattern::On), []);
        assert_eq!(phases(Pattern::Off), []);
        assert_eq!(phases(Pattern::Flickering)[..3], [50, 50, 50]);
        assert_eq!(phases(Pattern::Blinking)[..3], [200, 200, 200]);
        assert_eq!(phases(Pattern::Flashes(1))[..4], [1000, 200, 1000, 200]);
        assert_eq!(phases(Pattern::Flashes(2))[..4], [200, 200, 1000, 200]);
        assert_eq!(phases(Pattern::Flashes(4))[..8], [200, 200, 200, 200, 200, 200, 1000, 200]);
    }

    #[test]
    fn no_pattern_changes_between_two_multiples() {
        for pattern in [Pattern::Flickering, Pattern::Blinking, Pattern::Flashes(1), Pattern::Flashes(3)] {
            let changes = (1..100_000)
                .filter(|ms| pattern.is_on(Instant(ms * 100)) != pattern.is_on(Instant((ms - 1) * 100)));
            for ms in changes {
                assert_eq!(Indicators::next_change(Instant(ms * 100 - 1)), Instant(ms * 100), "{pattern:?}");
            }
        }
    }

    #[test]
    fn both_flicker_alternately() {
        let both = Indicators { run: Pattern::Flickering, error: Pattern::Flickering };
        for ms in 0..200 {
            let [run, error] = both.levels(Instant(ms * 1000));
            assert_ne!(run, error, "{ms}");
        }
    }
}
