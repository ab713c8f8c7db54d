//! Events of the traffic that the bus reports.

use crate::{BusError, Frame, Time};

/// An event on the wire that a bus analyser would show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// At least one participant received a frame without error.
    Frame {
        /// The start of frame.
        start: Time,
        /// The end of the end of frame.
        end: Time,
        /// The frame.
        frame: Frame,
        /// The sender: its place in the slice that `Bus::step` gets.
        transmitter: usize,
    },
    /// A frame ended with an error frame.
    Error {
        /// The start of frame.
        start: Time,
        /// The end of the error flags.
        end: Time,
        /// The frame that failed.
        frame: Frame,
        /// The error that the transmitter detected.
        error: BusError,
        /// The sender: its place in the slice that `Bus::step` gets.
        transmitter: usize,
    },
}
