//! The CANopen device: the protocols, the values of the dictionary, and the connections between them.
//!
//! There are two devices, one inside the other. [`ServiceDevice`] has NMT, SDO, heartbeat and LSS. [`Device`] adds PDO,
//! SYNC, EMCY, monitoring of other nodes' heartbeats and stored parameters.
//!
//! ```text
//! Node<Full> = Device                           Node<Basic> = ServiceDevice
//! ┌─────────────────────────────────────────┐   ┌───────────────────────────┐
//! │ Services: SDO server, LSS slave         │   │ Services                  │
//! │ Full ┌────────────────────────────────┐ │   │ Basic: values, NMT state, │
//! │      │ Basic                          │ │   │        heartbeat          │
//! │      └────────────────────────────────┘ │   └───────────────────────────┘
//! │      PDO, SYNC, EMCY, watches, storing  │
//! └─────────────────────────────────────────┘
//! ```
//!
//! Without a node-ID, a device reacts to LSS only.
//!
//! Every call returns the next deadlines and an action for the caller ([`Next`]). A single caller uses `on_frame` and
//! `poll`. Two callers of different priority share the device by its halves, one for process data and one for services.

mod application;
mod basic;
mod body;
mod events;
mod faults;
mod full;
mod lss;
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
mod watches;

pub use application::{Application, ErrorClass, Part};
pub use faults::BusEvent;
pub use next::{Action, Next};
pub use store::{Job, Soundness, Stored};

use crate::dictionary::Dictionary;
use crate::lss::BitRate;
use crate::nmt::State;
use crate::{Instant, NodeId};
use basic::Basic;
use body::Body;
use full::Full;
use services::Services;

/// A device with an application `A`, and room for its dictionary: an image of `N` bytes, `T` TPDOs, `R` RPDOs, `W`
/// heartbeats to monitor, and `M` objects that a multiplexed TPDO sends. `S` is the set of
/// [`Services`](crate::dictionary::Services); the code of services outside the set is not linked.
///
/// [`device!`](crate::device!) gives the type for a table of rows. PDOs, heartbeats and objects beyond the room do not
/// work.
pub type Device<
    A,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16 = { crate::dictionary::Services::ALL.bits() },
> = Node<Full<A, N, T, R, W, M, S>>;

/// A device with NMT, SDO, heartbeat and LSS only, such as a bootloader: an application `A` and an image of `N` bytes.
///
/// [`service_device!`](crate::service_device!) gives the type for a table of rows. Rows of other services hold values
/// without any effect.
pub type ServiceDevice<A, const N: usize> = Node<Basic<A, [u8; N]>>;

/// A device: its services, and the device body that they serve. Used as [`Device`] or [`ServiceDevice`].
#[derive(Debug)]
#[repr(C)] // The services are short. At the start of the structure, an instruction reaches their fields directly.
pub struct Node<B> {
    services: Services,
    body: B,
}

/// A deadline in the past: the next poll checks everything.
const STALE: Instant = Instant(0);

impl<B: Body> Node<B> {
    /// A device that has not started: it neither sends nor receives until [`start`](Node::start). The bit rate is only
    /// for LSS to store; it is 1 Mbit/s unless [`with_bit_rate`](Node::with_bit_rate) sets another one.
    pub fn new(
        dictionary: &'static Dictionary,
        node_id: impl Into<Option<NodeId>>,
        application: B::Application,
    ) -> Node<B> {
        let node_id = node_id.into();
        Node { services: Services::new(node_id), body: B::new(dictionary, node_id, application) }
    }

    /// Sets the configured bit rate. LSS stores it together with a new node-ID.
    #[must_use]
    pub fn with_bit_rate(mut self, bit_rate: BitRate) -> Node<B> {
        self.services.set_bit_rate(bit_rate);
        self
    }

    /// Reports the bit rate at which the bus runs. PDOs take at most three quarters of it, so that the heartbeat, EMCY and
    /// SDO always have room. [`with_bit_rate`](Node::with_bit_rate) and a change by LSS set it too; a caller that detects
    /// the bit rate sets it here.
    pub fn set_bus_bit_rate(&mut self, bit_rate: BitRate) {
        self.services.set_bus_bit_rate(bit_rate);
    }

    /// The node-ID in use.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.body.basic().node_id
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> State {
        self.body.basic().state
    }

    /// The values of all objects.
    #[must_use]
    pub fn image(&self) -> &B::Image {
        self.body.image()
    }

    /// Lets the application write its state to the image. Mapped values among them are sent with the next
    /// [`publish`](Device::publish) or event timer.
    pub fn show(&mut self, show: impl FnOnce(&mut B::Application, &mut [u8])) {
        let basic = self.body.basic_mut();
        show(&mut basic.application, &mut basic.image);
    }

    /// The application.
    #[must_use]
    pub fn application(&self) -> &B::Application {
        &self.body.basic().application
    }

    /// The application, mutable.
    pub fn application_mut(&mut self) -> &mut B::Application {
        &mut self.body.basic_mut().application
    }
}
