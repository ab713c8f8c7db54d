//! The bit rate of the node: the stored one, or one that is detected by listening as a guest (`bsp::policy::guest`).

use bsp::Frames;
use bsp::can::Controller;
use bsp::can::bit_timing::BitTiming;
use bsp::can::bus_state::Heard;
use bsp::policy::bit_rate_detection::Step;
use bsp::policy::guest::Guest;
use canopen::Instant;
use node::BitRate;

/// The bit timing of the bus, or the state of its detection.
pub(crate) enum Rate {
    /// The timing is known.
    Known(BitTiming),
    /// Automatic detection is configured; the search must be started.
    Unknown,
    /// No rate is stored: the node waits on a silent bus at the default rate, and searches on any other bus.
    Missing,
    /// The search is in progress.
    Searched(Guest, Origin),
}

/// Why a bit rate is searched.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Automatic detection is configured.
    Configured,
    /// No rate is stored: the found one is that of the node.
    Missing,
}

impl Rate {
    /// From the configured bit rate.
    pub(crate) fn of(bit_rate: BitRate) -> Rate {
        match BitTiming::of(bit_rate.kbit()) {
            Some(timing) => Rate::Known(timing),
            None => Rate::Unknown,
        }
    }

    /// Starts the search.
    pub(crate) fn search(&mut self, can: &mut Controller, frames: &mut Frames, now: Instant) {
        defmt::info!("looking for the bit rate");
        let ((guest, step), origin) = match self {
            Rate::Missing => (Guest::new(None), Origin::Missing),
            _ => (Guest::searching(now), Origin::Configured),
        };
        if let Step::Listen(timing) = step {
            can.listen(timing);
        }
        drop_all(frames);
        *self = Rate::Searched(guest, origin);
    }

    /// Continues a search in progress. Returns its origin when it has ended. Takes all frames.
    ///
    /// A frame counts for the rate at which the controller received it. The controller changes its rate at the end of
    /// the frame that is on the bus, so the last frame at a rate may arrive after the change was requested.
    pub(crate) fn go_on(
        &mut self,
        can: &mut Controller,
        frames: &mut Frames,
        now: Instant,
    ) -> Option<Origin> {
        let Rate::Searched(guest, origin) = self else { return None };
        let origin = *origin;
        let heard = if frames.dequeue().is_some() { Heard::Frame } else { can.heard() };
        match guest.step(heard, now) {
            Step::Stay => return None,
            Step::Listen(timing) => can.listen(timing),
            Step::Found(timing) => *self = Rate::Known(timing),
        }
        drop_all(frames);
        matches!(self, Rate::Known(_)).then_some(origin)
    }

    pub(crate) fn is_searched(&self) -> bool {
        matches!(self, Rate::Searched(..))
    }
}

/// Frames of the rate before count for no other rate, and frames without filters are not for this node.
fn drop_all(frames: &mut Frames) {
    while frames.dequeue().is_some() {}
}
