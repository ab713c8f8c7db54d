//! The interface of every client service that takes more than one frame.

use crate::{Duration, Frame, Instant};

/// A service under way. Every service ends after a bounded time, whatever the devices do.
pub trait Service {
    /// Result of the service.
    type Output;

    /// The next step. Hand over all received frames before this call: one of them may be the answer to a request that
    /// this call would otherwise repeat.
    ///
    /// After [`Step::Done`], every further call returns `Done` again.
    fn next(&mut self, now: Instant) -> Step<Self::Output>;

    /// Takes a frame from the bus. Frames that do not belong to the service are ignored.
    fn on_frame(&mut self, frame: &Frame, now: Instant) -> Taken;
}

/// A step that a service asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step<T> {
    /// Send this frame. The service asks only once: a caller with a full queue keeps the frame.
    Send(Frame),
    /// Hand over the frames that arrive, and call [`Service::next`] again at this instant at the latest.
    Wait(Instant),
    /// The service has ended.
    Done(T),
}

/// How a service has used a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// The frame was an answer for the service.
    Used,
    /// The frame is not for this service, or it repeats the frame before: a CAN frame whose acknowledgement is
    /// destroyed arrives twice.
    Ignored,
    /// The frame comes from the right device but does not fit the state of the service, such as a late answer to an
    /// earlier request. If no fitting answer follows, the service reports that the device does not follow the protocol.
    Unexpected,
}

/// The instant `span` after `now`; `NEVER` when the sum is too large.
pub(super) fn later(now: Instant, span: Duration) -> Instant {
    Instant(now.0.saturating_add(span.0))
}
