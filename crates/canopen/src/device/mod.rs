//! The CANopen device: the protocols, the dictionary's values and what connects them.
//!
//! There are two devices, one inside the other. [`ServiceDevice`] has NMT, SDO, heartbeat and LSS. [`Device`] has all of that, and
//! around it PDO, SYNC, EMCY, the heartbeats of other nodes and stored parameters.
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
//! Without a node-ID a device hears LSS and nothing else.
//!
//! Every call returns what follows from the call ([`Next`]). One caller uses `on_frame` and `poll`; two callers of two
//! priorities share the device by its halves, one for process data and one for services.

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

/// A device with an application `A`, and room for what its dictionary has: an image of `N` bytes, `T` TPDOs, `R` RPDOs, `W`
/// heartbeats to watch, and `M` objects that a multiplexed TPDO sends.
///
/// [`device!`](crate::device!) gives the type of a table of rows. PDOs, heartbeats and objects beyond the room do not work.
pub type Device<A, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize> =
    Node<Full<A, N, T, R, W, M>>;

/// A device with NMT, SDO, heartbeat and LSS alone, such as a bootloader: an application `A` and an image of `N` bytes.
///
/// [`service_device!`](crate::service_device!) gives the type of a table of rows. Rows of the other services hold values and
/// do nothing.
pub type ServiceDevice<A, const N: usize> = Node<Basic<A, [u8; N]>>;

/// A device: its services, and what they serve. Named as [`Device`] or [`ServiceDevice`].
#[derive(Debug)]
#[repr(C)] // The services first: they are short, and an instruction reaches what is near the beginning.
pub struct Node<B> {
    services: Services,
    body: B,
}

/// A deadline in the past: the next poll looks at everything.
const STALE: Instant = Instant(0);

impl<B: Body> Node<B> {
    /// A device that has not started: silent and deaf until [`start`](Node::start). It stores its bit rate for LSS
    /// only; 1 Mbit/s unless [`with_bit_rate`](Node::with_bit_rate) says otherwise.
    pub fn new(
        dictionary: &'static Dictionary,
        node_id: impl Into<Option<NodeId>>,
        application: B::Application,
    ) -> Node<B> {
        let node_id = node_id.into();
        Node { services: Services::new(node_id), body: B::new(dictionary, node_id, application) }
    }

    /// Takes the bit rate that is configured, for LSS to store along with a new node-ID.
    #[must_use]
    pub fn with_bit_rate(mut self, bit_rate: BitRate) -> Node<B> {
        self.services.set_bit_rate(bit_rate);
        self
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

    /// Lets the application show its state in the image. What of it is mapped is sent with the next
    /// [`publish`](Device::publish) or timer.
    pub fn show(&mut self, show: impl FnOnce(&mut B::Application, &mut [u8])) {
        let basic = self.body.basic_mut();
        show(&mut basic.application, &mut basic.image);
    }

    /// The application.
    #[must_use]
    pub fn application(&self) -> &B::Application {
        &self.body.basic().application
    }

    /// The application, to change its state.
    pub fn application_mut(&mut self) -> &mut B::Application {
        &mut self.body.basic_mut().application
    }
}
