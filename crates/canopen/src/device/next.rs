//! The result of every call of the device: the next deadlines, and an action for the caller.

use super::Job;
use crate::Instant;
use crate::lss::BitRate;

/// Result of a call: when to call again, and an action that is left to the caller.
///
/// A caller for both halves does three things with it: the action, new parameters, and a sleep until [`Next::due`] or
/// the next frame. Of two callers, one for process data and one for services, each sleeps until the instant of its own
/// half and wakes the other one when that one's instant has come.
///
/// Actions and parameters are handed over by `start`, `on_service_frame` and `poll_services` (and so by `on_frame` and
/// `poll`) and by no other call: where something waits after another call, the services are due at once.
#[must_use = "the deadlines have moved, and an action may be left to the caller"]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Next {
    /// When `poll_process` has something to do.
    pub process: Instant,
    /// When `poll_services` has something to do.
    pub services: Instant,
    /// An action for the caller, to be done now. Where more than one action waits, the services are due at once.
    pub action: Option<Action>,
    /// Parameters of the application may have changed.
    pub parameters: bool,
}

impl Next {
    /// When [`Device::poll`](super::Device::poll) has something to do.
    #[must_use]
    pub fn due(&self) -> Instant {
        self.process.min(self.services)
    }
}

/// Something that is left to the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// NMT reset node: restart everything, or at least call [`Device::start`](super::Device::start).
    ResetNode,
    /// NMT reset communication: discard frames that still wait to be sent, then call [`Device::start`](super::Device::start).
    ResetCommunication,
    /// The sets of identifiers to receive have changed.
    Identifiers,
    /// Run the bus at this bit rate from now on.
    BitRate(BitRate),
    /// Go to the bootloader; the request for it is not answered.
    Bootloader,
    /// Store something, then call [`Device::finish`](super::Device::finish).
    Store(Job),
}
