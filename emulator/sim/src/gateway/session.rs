//! The interface between a client protocol and the bus.

use canbus::{Frame, Time};

use crate::port::Adapter;

/// An action that a session requests; actions are carried out in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// Text to the client, in a separate segment, because python-can compares the bytes that one `recv` returns.
    Segment(String),
    /// Text to the client, joined with the text before and after it.
    Stream(String),
    /// Attach an adapter to the bus.
    Attach(Adapter),
    /// Leave the bus.
    Detach,
    /// Send a frame.
    Send(Frame),
    /// Close the connection: the client does not speak the protocol.
    Close,
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

    /// Bytes have arrived from the client. A client whose first bytes are not of the protocol is disconnected: any web page
    /// can make a browser connect to a port, and choose what follows the browser's own first bytes (HTTP, TLS).
    fn on_bytes(&mut self, bytes: &[u8], out: &mut Vec<Action>);

    /// A frame of another participant was on the bus; returns the text for the client.
    fn on_frame(&mut self, frame: &Frame, at: Time) -> Option<String>;
}
