//! The node as a guest on the bus: see [`bsp::guest`]. What is heard before the guest stays is nobody's but the guest's.

use bsp::bit_rate_detection::{Heard, Step};
use bsp::guest::Guest;
use bsp::{Clock, Frames};
use canopen::{Duration, Instant};

use crate::identity::Identity;
use crate::outbox::Outbox;
use crate::session::Session;

/// How often to look at what was heard. An error ends the sleep before.
const LOOK: Duration = Duration::from_millis(2);

/// The visit.
pub(crate) struct Visit(Guest);

impl Visit {
    /// Begins it: goes on the bus, or listens.
    pub(crate) fn begin(identity: Identity, session: &mut Session, out: &mut Outbox) -> Visit {
        let (guest, step) = Guest::new(identity.timing);
        session.go(step, out);
        Visit(guest)
    }

    /// Whether frames are to be answered.
    pub(crate) fn is_on_bus(&self) -> bool {
        !self.0.is_listening()
    }

    /// Takes what was heard, until the guest stays. Of a guest that listens the frames are taken too; they count for the rate at
    /// which they were heard.
    pub(crate) fn go_on(&mut self, session: &mut Session, frames: &mut Frames, out: &mut Outbox) {
        if self.0.is_staying() {
            return;
        }
        let has_frame = self.0.is_listening() && drop_all(frames);
        let heard = session.heard();
        let step = self.0.step(if has_frame { Heard::Frame } else { heard }, Clock::now());
        if step != Step::Stay {
            session.go(step, out);
            // A frame of the old rate may have ended meanwhile. Whoever goes on the bus answers all that comes from then on.
            if self.0.is_listening() {
                drop_all(frames);
            }
        }
    }

    /// When to go on, at the latest.
    pub(crate) fn due(&self) -> Option<Instant> {
        (!self.0.is_staying()).then(|| Clock::now() + LOOK)
    }
}

/// Whether there was a frame.
fn drop_all(frames: &mut Frames) -> bool {
    core::iter::from_fn(|| frames.dequeue()).count() > 0
}
