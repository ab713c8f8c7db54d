//! Ways onto a CAN bus. One trait, so that everything above it runs on any adapter and in a test without one.

mod address;
pub(crate) mod clock;
mod none;
mod simulated;
mod slcan;
#[cfg(target_os = "linux")]
mod socketcan;
mod socketcand;
mod stream;

use std::io;

use canopen::{Frame, Instant};
use thiserror::Error;

pub use address::{Address, AddressError};
pub use none::NoBus;
pub use simulated::{Simulated, Station};

/// Access to a CAN bus.
///
/// CANopen uses 11-bit identifiers: frames with longer ones are not reported, nor are those that were sent here.
pub trait Bus {
    /// The time, from some start on. It goes on while nothing is called, unless it is virtual.
    fn now(&self) -> Instant;

    /// Sends a frame, or hands it to a queue that will.
    ///
    /// # Errors
    /// [`BusError::Lost`].
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// The next frame of somebody else; `None` when there was none until then. With an instant that has passed, it looks
    /// whether there is one and does not wait.
    ///
    /// # Errors
    /// [`BusError::Lost`].
    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError>;
}

/// A frame from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The frame.
    pub frame: Frame,
    /// When it was on the bus, by the clock of the adapter where it has one, else when it arrived here. Only the
    /// difference of two such times means something.
    pub at: Instant,
}

/// Why the bus cannot be used.
#[derive(Debug, Error)]
pub enum BusError {
    /// It could not be opened.
    #[error("cannot open {address}: {reason}")]
    Open {
        /// What was asked for.
        address: String,
        /// Why not.
        reason: io::Error,
    },
    /// It was open, and is gone.
    #[error("the bus is lost: {0}")]
    Lost(io::Error),
}
