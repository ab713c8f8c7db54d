//! The CANopen device: the protocols, the values of the dictionary, and the connections between them.
//!
//! A [`Device`] is its SDO server and its LSS slave, and the inner device on which they act: values, NMT state, process
//! data, faults. Its [`Definition`] follows from the rows, and the compiler removes each service that the rows lack. A
//! [`ServiceDevice`] has NMT, SDO, heartbeat and LSS only.
//!
//! Without a node-ID, a device reacts to LSS only.
//!
//! Every call returns the next deadlines and an action for the caller ([`Next`]). A single caller uses `on_frame` and
//! `poll`. Two callers of different priority share the device by its halves, one for process data and one for services.

mod application;
mod definition;
mod emergencies;
mod events;
mod faults;
mod indicators;
mod inner;
mod lss;
mod more_sdo;
mod multiplexed;
mod next;
mod objects;
mod pdos;
mod process;
mod rpdos;
mod services;
mod state;
mod store;
mod syncs;
mod times;
mod watches;

pub use application::Application;
pub use definition::{Definition, Rows};
pub use faults::BusEvent;
pub use next::{Action, Next};
pub use state::Reset;
pub use store::{Damage, Job, Soundness, Stored};

use crate::dictionary::Dictionary;
use crate::lss::BitRate;
use crate::nmt::State;
use crate::time::Clock;
use crate::{Instant, NodeId, Tick};
use inner::Inner;
use services::Services;

/// A device. [`device!`](crate::device!) gives the type for a table of rows. PDOs, heartbeats and objects beyond the room
/// do not work.
#[repr(C)] // The services are short. At the start of the structure, an instruction reaches their fields directly.
pub struct Device<D: Definition> {
    clock: Clock,
    services: Services<D>,
    inner: Inner<D>,
}

impl<D: Definition> core::fmt::Debug for Device<D> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut device = f.debug_struct("Device");
        device.field("node_id", &self.node_id()).field("state", &self.state()).finish_non_exhaustive()
    }
}

/// A device with NMT, SDO, heartbeat and LSS only, such as a bootloader: an application `A` and an image of `N` bytes.
///
/// [`service_device!`](crate::service_device!) gives the type for a table of rows. Rows of other services hold values
/// without any effect.
pub type ServiceDevice<A, const N: usize> = Device<Rows<A, N, 0, 0, 0, 0, 0, 0>>;

/// A deadline in the past: the next poll checks everything.
const STALE: Tick = Tick::PAST;

impl<D: Definition> Device<D> {
    /// A device that has not started: it neither sends nor receives until [`start`](Device::start). The bit rate is only
    /// for LSS to store; it is 1 Mbit/s unless [`with_bit_rate`](Device::with_bit_rate) sets another one.
    pub fn new(
        dictionary: &'static Dictionary,
        node_id: impl Into<Option<NodeId>>,
        application: D::Application,
    ) -> Device<D> {
        let node_id = node_id.into();
        Device {
            services: Services::new(node_id),
            inner: Inner::new(dictionary, node_id, application),
            clock: Clock::new(),
        }
    }

    /// Sets the configured bit rate. LSS stores it together with a new node-ID.
    #[must_use]
    pub fn with_bit_rate(mut self, bit_rate: BitRate) -> Device<D> {
        self.services.set_bit_rate(bit_rate);
        self
    }

    /// Sets the configured bit rate, as [`with_bit_rate`](Device::with_bit_rate) does, of a caller that has detected it.
    pub fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.services.set_bit_rate(bit_rate);
    }

    /// Sets the present bit rate of the bus. PDOs take at most three quarters of the bus, so that the heartbeat, EMCY and SDO
    /// always have room. [`with_bit_rate`](Device::with_bit_rate) and a change by LSS set the bit rate too; a caller that
    /// detects the bit rate sets it here.
    pub fn set_bus_bit_rate(&mut self, bit_rate: BitRate) {
        self.services.set_bus_bit_rate(bit_rate);
    }

    /// The present inside the device.
    // Not inlined: many callers.
    #[inline(never)]
    fn tick(&mut self, now: Instant) -> Tick {
        self.tick_of_frame(now)
    }

    /// As [`tick`](Device::tick), for the calls that hand over a frame.
    #[inline]
    fn tick_of_frame(&mut self, now: Instant) -> Tick {
        self.clock.tick(now).unwrap_or_else(|| self.follow(now))
    }

    /// Moves the epoch of the clock, and all ticks with it.
    #[cold]
    #[inline(never)]
    fn follow(&mut self, now: Instant) -> Tick {
        let (now, by) = self.clock.follow(now);
        self.services.shift(by);
        self.inner.shift(by);
        now
    }

    /// The node-ID in use.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.inner.node_id
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> State {
        self.inner.state
    }

    /// The NMT state of a node whose heartbeat is monitored (1016h); `None` before its first heartbeat, and while its
    /// heartbeat is missing.
    #[must_use]
    pub fn state_of(&self, node: NodeId) -> Option<State> {
        self.inner.watches.state(node)
    }

    /// The values of all objects.
    #[must_use]
    pub fn image(&self) -> &D::Image {
        &self.inner.image
    }

    /// Lets the application write its state to the image. Mapped values among them are sent with the next
    /// [`publish`](Device::publish) or event timer. Nothing checks the values, and a new communication parameter has no effect:
    /// set it in [`Application::initialise`]. Only the COB-IDs of 1028h, 1201h and 1280h apply at once, without an
    /// [`Action::Identifiers`]: set the acceptance filters again.
    pub fn show(&mut self, show: impl FnOnce(&mut D::Application, &mut [u8])) {
        show(&mut self.inner.application, self.inner.image.as_mut());
    }

    /// The application.
    #[must_use]
    pub fn application(&self) -> &D::Application {
        &self.inner.application
    }

    /// The application, mutable.
    pub fn application_mut(&mut self) -> &mut D::Application {
        &mut self.inner.application
    }
}
