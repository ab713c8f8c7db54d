//! At which bit rate the node runs: the configured one, or the one that a silent search finds.

use bsp::bit_rate_detection::{Detector, Heard, Step};
use bsp::bit_timing::BitTiming;
use bsp::can::Controller;
use canopen::Instant;
use node::BitRate;

/// The timing of the bus, once it is known.
pub(crate) enum Rate {
    /// This one.
    Known(BitTiming),
    /// A search is to begin.
    Unknown,
    /// A search is going on.
    Searched(Detector),
}

impl Rate {
    /// From what is configured.
    pub(crate) fn of(bit_rate: BitRate) -> Rate {
        match BitTiming::of(bit_rate.kbit()) {
            Some(timing) => Rate::Known(timing),
            None => Rate::Unknown,
        }
    }

    /// Begins the search.
    pub(crate) fn search(&mut self, can: &mut Controller, now: Instant) {
        defmt::info!("looking for the bit rate");
        let detector = Detector::new(now);
        can.listen(detector.timing());
        *self = Rate::Searched(detector);
    }

    /// Goes on with the search, if one is going on. True when it has come to its end.
    pub(crate) fn go_on(&mut self, can: &mut Controller, has_frame: bool, now: Instant) -> bool {
        let Rate::Searched(detector) = self else { return false };
        let heard = if has_frame { Heard::Frame } else { can.heard() };
        match detector.step(heard, now) {
            Step::Stay => return false,
            Step::Listen(timing) => can.listen(timing),
            Step::Found(timing) => *self = Rate::Known(timing),
        }
        matches!(self, Rate::Known(_))
    }

    pub(crate) fn is_searched(&self) -> bool {
        matches!(self, Rate::Searched(_))
    }
}
