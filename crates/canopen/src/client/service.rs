//! The interface of every client service that takes more than one frame.

use crate::{Duration, Frame, Instant};

/// A service under way. It ends by itself: each has a bound on how long it takes, whatever the devices do.
pub trait Service {
    /// Result of the service.
    type Output;

    /// The next step. Received frames are to be handed over before: the answer to a request that is asked for here may
    /// be among them.
    ///
    /// After [`Step::Done`] it says `Done` again.
    fn next(&mut self, now: Instant) -> Step<Self::Output>;

    /// Takes a frame from the bus; frames of others are passed over.
    fn on_frame(&mut self, frame: &Frame, now: Instant) -> Taken;
}

/// A step that a service asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step<T> {
    /// Send this frame. It is asked for once: a caller whose queue is full keeps the frame.
    Send(Frame),
    /// Hand over the frames that arrive, and ask again at this instant at the latest.
    Wait(Instant),
    /// The service has ended.
    Done(T),
}

/// How a service has used a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// The frame has brought the service forward.
    Used,
    /// The frame is not for this service, or it is one more copy of the last one: a CAN frame whose acknowledgement is
    /// destroyed arrives twice.
    Ignored,
    /// The frame comes from the right device and does not fit here. It may be a late answer to an earlier request. A
    /// service that waits in vain after such a frame says that the device does not follow the protocol.
    Unfit,
}

/// An instant later by this span; a span that is too long gives `NEVER`.
pub(super) fn later(now: Instant, span: Duration) -> Instant {
    Instant(now.0.saturating_add(span.0))
}
