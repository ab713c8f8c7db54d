//! What the bus tells about its traffic.

use crate::{BusError, Frame, Time};

/// Something on the wire that a bus analyser would show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame was received without error by somebody.
    Frame {
        /// Its start of frame.
        start: Time,
        /// The end of its end of frame.
        end: Time,
        /// The frame.
        frame: Frame,
        /// Who sent it, by its place in the slice that `Bus::step` gets.
        transmitter: usize,
    },
    /// An error frame followed the frame that somebody began.
    Error {
        /// The start of frame.
        start: Time,
        /// The end of the error flags.
        end: Time,
        /// The frame that was to be sent.
        frame: Frame,
        /// What its transmitter detected.
        error: BusError,
        /// Who tried to send it.
        transmitter: usize,
    },
}
