//! Access to CAN buses. All code above the trait [`Bus`] runs on any adapter, and in tests without an adapter.

mod address;
pub(crate) mod clock;
mod controller;
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
pub use controller::{Controller, State};
pub use none::NoBus;
pub use simulated::{Simulated, Station};

/// Access to a CAN bus.
///
/// CANopen uses 11-bit identifiers. Frames with 29-bit identifiers are not reported, and neither are frames that this
/// program has sent.
pub trait Bus {
    /// The time since some start. It passes between calls, except on a simulated bus.
    fn now(&self) -> Instant;

    /// Sends a frame, or puts it into the queue of the adapter.
    ///
    /// # Errors
    /// [`BusError::Lost`].
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// The next frame of another node; `None` when none has come until then. With an instant in the past, the function
    /// does not wait: it returns a frame only if one is there.
    ///
    /// # Errors
    /// [`BusError::Lost`].
    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError>;

    /// The last report of the adapter about its controller. A call may request a new report for the next call.
    fn controller(&mut self) -> Controller {
        Controller::default()
    }
}

/// A frame from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The frame.
    pub frame: Frame,
    /// Time of the frame on the bus, by the clock of the adapter. Without such a clock, the time of its arrival here.
    /// Only differences have a meaning.
    pub at: Instant,
}

/// Why the bus cannot be used.
#[derive(Debug, Error)]
pub enum BusError {
    /// The bus could not be opened.
    #[error("cannot open {address}: {reason}")]
    Open {
        /// The address of the bus.
        address: String,
        /// The reason.
        reason: io::Error,
    },
    /// The bus was open, and is lost.
    #[error("the bus is lost: {0}")]
    Lost(io::Error),
}
