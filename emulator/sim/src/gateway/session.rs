//! What a protocol between the bus and a network client is made of.

use canbus::{Frame, Time};

use crate::port::Adapter;

/// What a session wants done, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// To the client, in a segment of its own: python-can compares what one `recv` returns.
    Segment(String),
    /// To the client, together with what comes before and after it.
    Stream(String),
    /// Go on the bus.
    Attach(Adapter),
    /// Leave the bus.
    Detach,
    /// Send a frame.
    Send(Frame),
}

impl Action {
    /// [`Action::Segment`].
    pub(super) fn segment(text: impl Into<String>) -> Action {
        Action::Segment(text.into())
    }

    /// [`Action::Stream`].
    pub(super) fn stream(text: impl Into<String>) -> Action {
        Action::Stream(text.into())
    }
}

/// One client's side of a protocol, without sockets: bytes and frames in, actions out.
pub(super) trait Session {
    /// The client has connected.
    fn greet(&mut self, out: &mut Vec<Action>);

    /// Bytes have arrived from the client.
    fn on_bytes(&mut self, bytes: &[u8], out: &mut Vec<Action>);

    /// A frame of somebody else's was on the bus; what to tell the client.
    fn on_frame(&mut self, frame: &Frame, at: Time) -> Option<String>;
}
