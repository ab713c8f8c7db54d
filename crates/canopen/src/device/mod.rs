//! The CANopen device: the protocols, the dictionary's values and what connects them.
//!
//! Without a node-ID it hears LSS and nothing else.
//!
//! Every call returns what follows from it ([`Next`]). One caller uses `on_frame` and `poll`; two callers of two
//! priorities share the device by its halves, one for process data and one for services.

mod application;
mod events;
mod faults;
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

use crate::dictionary::{Dictionary, Groups};
use crate::lss::{BitRate, Configuration, Slave};
use crate::nmt::State;
use crate::pdo::{Links, Rpdo, Scanner, Tpdo};
use crate::sdo::Server;
use crate::{CanId, Instant, NodeId, emcy, heartbeat, sync};

/// A CANopen device with an application `A`, and room for what its dictionary has: an image of `N` bytes, `T` TPDOs, `R`
/// RPDOs, `W` heartbeats to watch, and `M` objects that a multiplexed TPDO sends.
///
/// [`device!`](crate::device!) gives the type of a table of rows. Of what a dictionary has beyond the room, the device
/// does nothing.
#[derive(Debug)]
pub struct Device<
    A,
    const N: usize,
    const T: usize = 8,
    const R: usize = 8,
    const W: usize = 4,
    const M: usize = 48,
> {
    server: Server,
    /// When to try again to send a reply of the server that found the queue full.
    reply_due: Instant,
    /// When to go on with a block that found the queue full.
    block_due: Instant,
    lss: Slave,
    /// The last response of LSS, and when to try again if it found the queue full.
    lss_reply: [u8; 8],
    lss_reply_due: Instant,
    switching: lss::Switching,
    /// When its next step is due.
    switching_due: Instant,
    core: Core<A, N, T, R, W, M>,
}

/// All but the SDO server: what the server serves.
#[derive(Debug)]
struct Core<A, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize> {
    dictionary: &'static Dictionary,
    /// `None` for a device that waits to be given one.
    node_id: Option<NodeId>,
    state: State,
    image: [u8; N],
    application: A,
    heartbeat: heartbeat::Producer,
    watches: heartbeat::Consumer<W>,
    sync: sync::Consumer,
    emcy: emcy::Producer,
    tpdos: [Tpdo; T],
    rpdos: [Rpdo; R],
    /// The lowest five bits of the CAN-IDs of all valid RPDOs, as a set of 32 bits: most frames for other nodes are not in
    /// the set, and need no further look.
    rpdo_filter: u32,
    scanner: Scanner<M>,
    /// The RPDO that takes the multiplexed PDOs of all nodes: its CAN-ID and place.
    all_nodes: Option<(CanId, u16)>,
    /// One of the TPDOs tells events.
    tells_events: bool,
    /// Where the chains of PDOs begin.
    first_tpdos: Links,
    first_rpdos: Links,
    /// Cached next deadlines; `STALE` after a change that may have moved them.
    process_due: Instant,
    services_due: Instant,
    pending: state::Pending,
    jobs: store::Jobs,
    /// The groups of which the defaults hold although values are stored.
    lost: Groups,
    /// The groups of which older values hold than those that were stored last.
    older: Groups,
    is_bus_off: bool,
}

/// A deadline in the past: the next poll looks at everything.
const STALE: Instant = Instant(0);

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    /// A device that has not started: silent and deaf until [`start`](Device::start). It stores its bit rate for LSS
    /// only; 1 Mbit/s unless [`with_bit_rate`](Device::with_bit_rate) says otherwise.
    pub fn new(
        dictionary: &'static Dictionary,
        node_id: impl Into<Option<NodeId>>,
        application: A,
    ) -> Device<A, N, T, R, W, M> {
        let node_id = node_id.into();
        let emcy = emcy::Producer::new(A::CONDITIONS, application.register_bits());
        Device {
            server: Server::new(),
            reply_due: Instant::NEVER,
            block_due: Instant::NEVER,
            lss: Slave::new(Configuration { node_id, bit_rate: BitRate::FASTEST }),
            lss_reply: [0; 8],
            lss_reply_due: Instant::NEVER,
            switching: lss::Switching::No,
            switching_due: Instant::NEVER,
            core: Core {
                dictionary,
                node_id,
                state: State::Initialising,
                image: [0; N],
                application,
                heartbeat: heartbeat::Producer::new(),
                watches: heartbeat::Consumer::new(),
                sync: sync::Consumer::new(),
                emcy,
                tpdos: [const { Tpdo::new() }; T],
                rpdos: [const { Rpdo::new() }; R],
                rpdo_filter: 0,
                scanner: Scanner::new(),
                all_nodes: None,
                tells_events: false,
                first_tpdos: Links::END,
                first_rpdos: Links::END,
                process_due: Instant::NEVER,
                services_due: Instant::NEVER,
                pending: state::Pending::new(),
                jobs: store::Jobs::new(),
                lost: Groups::NONE,
                older: Groups::NONE,
                is_bus_off: false,
            },
        }
    }

    /// Takes the bit rate that is configured, for LSS to store along with a new node-ID.
    #[must_use]
    pub fn with_bit_rate(mut self, bit_rate: BitRate) -> Device<A, N, T, R, W, M> {
        self.lss = Slave::new(Configuration { bit_rate, ..self.lss.pending() });
        self
    }

    /// The node-ID in use.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.core.node_id
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> State {
        self.core.state
    }

    /// The values of all objects.
    #[must_use]
    pub fn image(&self) -> &[u8; N] {
        &self.core.image
    }

    /// Lets the application show its state in the image. What of it is mapped is sent with the next
    /// [`publish`](Device::publish) or timer.
    pub fn show(&mut self, show: impl FnOnce(&mut A, &mut [u8])) {
        show(&mut self.core.application, &mut self.core.image);
    }

    /// The application.
    #[must_use]
    pub fn application(&self) -> &A {
        &self.core.application
    }

    /// The application, to change its state.
    pub fn application_mut(&mut self) -> &mut A {
        &mut self.core.application
    }
}
