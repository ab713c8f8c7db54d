//! The result of every call of the device: the next deadlines, and an action for the caller.

use super::Job;
use crate::Instant;
use crate::lss::BitRate;

/// Result of a call: when to call again, and an action for the caller.
///
/// A caller of both halves carries out the action, handles new parameters, and sleeps until [`Next::due`] or the next
/// frame. Of two callers, one for process data and one for services, each sleeps until the deadline of its own half,
/// and wakes the other caller when the other deadline has passed.
///
/// Only `start`, `on_service_frame`, `poll_services` and `nmt` (and so `on_frame` and `poll`) return actions and parameters.
/// If something waits after another call, the services are due at once.
#[must_use = "the deadlines have moved, and an action may be left to the caller"]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Next {
    /// The next deadline of `poll_process`.
    pub process: Instant,
    /// The next deadline of `poll_services`.
    pub services: Instant,
    /// An action to carry out now. If further actions wait, the services are due at once.
    pub action: Option<Action>,
    /// Parameters of the application may have changed.
    pub parameters: bool,
}

impl Next {
    /// The next deadline of [`Device::poll`](super::Device::poll).
    #[must_use]
    pub fn due(&self) -> Instant {
        self.process.min(self.services)
    }
}

/// An action that the caller carries out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// NMT reset node: restart everything, or at least call [`Device::start`](super::Device::start).
    ResetNode,
    /// NMT reset communication: discard frames that still wait to be sent, then call
    /// [`Device::start`](super::Device::start).
    ResetCommunication,
    /// The sets of identifiers to receive have changed.
    Identifiers,
    /// Run the bus at this bit rate from now on.
    BitRate(BitRate),
    /// Start the bootloader. The device does not answer the request.
    Bootloader,
    /// Store or restore values, then call [`Device::finish`](super::Device::finish).
    Store(Job),
}
