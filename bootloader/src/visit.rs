//! The node as a guest on the bus: see [`bsp::policy::guest`]. Until the guest stays, received frames are used for the bit rate
//! only.

use bsp::can::bus_state::Heard;
use bsp::policy::bit_rate_detection::Step;
use bsp::policy::guest::Guest;
use bsp::{Clock, Frames};
use canopen::{Duration, Instant};

use crate::identity::Identity;
use crate::outbox::Outbox;
use crate::run::after;
use crate::session::Session;

/// Polling interval for frames and errors. An error ends the sleep earlier.
const LOOK: Duration = Duration::from_millis(2);

/// The bootloader's guest.
pub(crate) struct Visit(Guest);

impl Visit {
    /// Starts: joins the bus, or listens.
    pub(crate) fn begin(identity: Identity, session: &mut Session, out: &mut Outbox) -> Visit {
        let (guest, step) = Guest::new(identity.timing);
        session.go(step, out);
        Visit(guest)
    }

    /// Whether the node takes part in the traffic of the bus.
    pub(crate) fn is_on_bus(&self) -> bool {
        !self.0.is_listening()
    }

    /// Evaluates frames and errors until the guest stays. While the guest listens, frames are taken out of the queue
    /// too; they count for the rate at which they were received.
    pub(crate) fn go_on(&mut self, session: &mut Session, frames: &mut Frames, out: &mut Outbox) {
        if self.0.is_staying() {
            return;
        }
        let has_frame = self.0.is_listening() && drop_all(frames);
        let heard = session.heard();
        let step = self.0.step(if has_frame { Heard::Frame } else { heard }, Clock::now());
        if step != Step::Stay {
            session.go(step, out);
            // A frame may have ended before the controller left the old rate. No frame fits between the start at the new
            // rate and this line, so all frames on the bus from then on are answered.
            drop_all(frames);
        }
    }

    /// Latest time of the next call of `go_on`.
    pub(crate) fn due(&self) -> Option<Instant> {
        (!self.0.is_staying()).then(|| after(LOOK))
    }
}

/// Drops all frames; returns whether there was one.
fn drop_all(frames: &mut Frames) -> bool {
    core::iter::from_fn(|| frames.dequeue()).count() > 0
}
