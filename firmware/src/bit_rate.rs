//! At which bit rate the node runs: the stored one, or the one that it finds as a guest who listens (`bsp::guest`).

use bsp::Frames;
use bsp::bit_rate_detection::{Heard, Step};
use bsp::bit_timing::BitTiming;
use bsp::can::Controller;
use bsp::guest::Guest;
use canopen::Instant;
use node::BitRate;

/// The timing of the bus, once it is known.
pub(crate) enum Rate {
    /// This one.
    Known(BitTiming),
    /// A search is to begin: automatic detection.
    Unknown,
    /// None is stored: a silent bus is listened to at the one of a node as delivered, any other bus is searched.
    Missing,
    /// A search is going on.
    Searched(Guest),
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
    pub(crate) fn search(&mut self, can: &mut Controller, frames: &mut Frames, now: Instant) {
        defmt::info!("looking for the bit rate");
        let (guest, step) = match self {
            Rate::Missing => Guest::new(None),
            _ => Guest::searching(now),
        };
        if let Step::Listen(timing) = step {
            can.listen(timing);
        }
        drop_all(frames);
        *self = Rate::Searched(guest);
    }

    /// Goes on with the search, if one is going on. True when the search has come to its end. Takes all frames.
    ///
    /// A frame counts for the rate at which the controller has listened to it. The controller changes its rate at the end of the
    /// frame that is on the bus, so the last frame of a rate may come when the change is already asked for.
    pub(crate) fn go_on(&mut self, can: &mut Controller, frames: &mut Frames, now: Instant) -> bool {
        let Rate::Searched(guest) = self else { return false };
        let heard = if frames.dequeue().is_some() { Heard::Frame } else { can.heard() };
        match guest.step(heard, now) {
            Step::Stay => return false,
            Step::Listen(timing) => can.listen(timing),
            Step::Found(timing) => *self = Rate::Known(timing),
        }
        drop_all(frames);
        matches!(self, Rate::Known(_))
    }

    pub(crate) fn is_searched(&self) -> bool {
        matches!(self, Rate::Searched(_))
    }
}

fn drop_all(frames: &mut Frames) {
    while frames.dequeue().is_some() {}
}
