//! Detection of the bit rate of a bus by silent listening: without frames, acknowledges and error frames.
//!
//! The rates are tried in turn until a frame is received. A try ends at once with an error, and after some time with
//! silence. That time doubles from round to round up to 1.28 s. A bus with a frame in every such interval, for example
//! one heartbeat a second, is therefore always detected, and a busy bus within some hundredths of a second.

use canopen::{Duration, Instant};

use crate::can::bit_timing::BitTiming;
use crate::can::bus_state::Heard;

/// The rates, the most common in the field first.
static RATES: [BitTiming; 8] = [
    BitTiming::at(250),
    BitTiming::at(500),
    BitTiming::at(125),
    BitTiming::at(1000),
    BitTiming::at(50),
    BitTiming::at(20),
    BitTiming::at(800),
    BitTiming::at(10),
];
/// Longer than the longest frame at 10 kbit/s (14 ms) and than the polling interval of 20 ms.
const FIRST: Duration = Duration::from_millis(40);
const LONGEST: Duration = Duration::from_millis(1_280);

/// The next step of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Continue listening.
    Stay,
    /// Listen at this rate.
    Listen(BitTiming),
    /// The bit rate is this one.
    Found(BitTiming),
}

/// A search for the bit rate.
#[derive(Debug)]
pub struct Detector {
    rate: usize,
    patience: Duration,
    until: Instant,
}

impl Detector {
    /// Begins a search; the first rate to listen at is [`Detector::timing`].
    #[must_use]
    pub fn new(now: Instant) -> Detector {
        Detector { rate: 0, patience: FIRST, until: now + FIRST }
    }

    /// The rate of the present try.
    #[must_use]
    pub fn timing(&self) -> BitTiming {
        RATES.get(self.rate).copied().unwrap_or(BitTiming::FASTEST)
    }

    /// Takes the events at the present rate.
    pub fn step(&mut self, heard: Heard, now: Instant) -> Step {
        match heard {
            Heard::Frame => Step::Found(self.timing()),
            Heard::Silence if now < self.until => Step::Stay,
            Heard::Silence | Heard::Nobody | Heard::Error => self.next(now),
        }
    }

    fn next(&mut self, now: Instant) -> Step {
        self.rate += 1;
        if self.rate == RATES.len() {
            self.rate = 0;
            self.patience = Duration(self.patience.0 * 2).min(LONGEST);
        }
        self.until = now + self.patience;
        Step::Listen(self.timing())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rate_of_the_table_is_tried() {
        let mut rates = RATES.map(BitTiming::kbit);
        rates.sort_unstable();
        assert_eq!(rates, [10, 20, 50, 125, 250, 500, 800, 1000]);
    }

    #[test]
    fn an_error_moves_on_at_once_and_silence_in_time() {
        let mut detector = Detector::new(Instant(0));
        assert_eq!(detector.timing().kbit(), 250);
        assert_eq!(detector.step(Heard::Silence, Instant(39_999)), Step::Stay);
        assert_eq!(detector.step(Heard::Silence, Instant(40_000)), Step::Listen(BitTiming::of(500).unwrap()));
        assert_eq!(detector.step(Heard::Error, Instant(40_001)), Step::Listen(BitTiming::of(125).unwrap()));
        assert_eq!(detector.step(Heard::Frame, Instant(40_002)), Step::Found(BitTiming::of(125).unwrap()));
    }

    /// One heartbeat a second and nothing else, at each of the rates, starting at any time.
    #[test]
    fn a_bus_with_a_frame_a_second_is_understood() {
        for rate in RATES.map(BitTiming::kbit) {
            for offset in (0..1_000_000).step_by(70_000) {
                let mut detector = Detector::new(Instant(0));
                let found = (0..2_000).map(|i| Instant(i * 20_000)).find(|&now| {
                    // The worst case: frames at another rate cause not even an error.
                    let is_understood = detector.timing().kbit() == rate;
                    let is_heard = is_understood && (now.0 + offset) % 1_000_000 < 20_000;
                    let heard = if is_heard { Heard::Frame } else { Heard::Silence };
                    matches!(detector.step(heard, now), Step::Found(timing) if timing.kbit() == rate)
                });
                assert!(found.is_some(), "{rate} kbit/s from {offset}");
            }
        }
    }
}
