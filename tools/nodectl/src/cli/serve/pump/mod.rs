//! The thread that owns the bus. It distributes the received frames and starts the jobs that pages request.

mod due;
mod frames;
mod orders;
mod work;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Duration as StdDuration;

use canopen::{Duration, Instant, NodeId};
use serde_json::Value as Json;

use super::bus_time::BusTime;
use super::jobs::Job;
use super::live::Live;
use super::nodes::Nodes;
use super::order::{Order, Refusal};
use super::pages::Pages;
use super::port::Outlet;
use super::schedule::Schedule;
use super::status::{Count, Rate};
use super::tracer::Tracer;
use super::turn::Turn;
use crate::Catalogue;
use crate::bus::{Bus, BusError, Controller, clock};
use crate::cli::Options;
use crate::cli::load::Peak;
use crate::other_clients::OtherClients;
use crate::page::{Hub, PageId};
use crate::trace::Transfers;

/// The number of frames that are taken before the next look for orders.
const AT_ONCE: usize = 512;
/// How long to listen to a quiet bus before the next look for orders. While jobs run, the pump waits for their orders,
/// not for frames.
const LISTEN: Duration = Duration(4000);
const PAUSE: StdDuration = StdDuration::from_micros(400);
/// The time between two attempts to open a lost bus.
const REOPEN: Duration = Duration::from_millis(1000);
/// A node gets a new survey when its PDO parameters have not been written for this time, in seconds.
const SETTLED: f64 = 0.3;
/// The time after which a node that has not told its identity is asked again, in seconds.
const ASK_AGAIN: f64 = 10.0;
/// A node is asked for its identity this long after its boot-up, in seconds: a master configures it first.
const AFTER_BOOT: f64 = 2.0;
/// A node is asked for its identity when no other client has sent it a request for this time.
const ALONE: Duration = Duration::from_millis(10_000);
/// A node is surveyed and polled for the pages when no other client has sent it a request for this time.
const CALM: Duration = Duration::from_millis(1000);
/// Another client of a node is shown as active for this time after its last request.
const ACTIVE: Duration = Duration::from_millis(5000);

/// The version of the protocol with the pages.
const PROTOCOL: u32 = 1;

/// The page that waits for a job.
#[derive(Clone, Debug)]
struct Asker {
    page: PageId,
    id: Json,
}

/// A job in the queue.
struct Waiting {
    asker: Option<Asker>,
    node: Option<NodeId>,
    /// Whether the job ends when its page leaves: it changes nothing on the bus.
    only_reads: bool,
    job: Job,
}

/// A running job.
struct Running {
    number: u64,
    asker: Option<Asker>,
    node: Option<NodeId>,
    is_update: bool,
    only_reads: bool,
    turn: Arc<Turn>,
}

/// The settings of the pump.
pub(super) struct Setup {
    pub(super) options: Options,
    pub(super) silent: bool,
    pub(super) control: Option<std::net::SocketAddr>,
    pub(super) hub: Arc<Hub>,
}

/// The times at which events are due.
#[derive(Default)]
struct Due {
    live: Instant,
    trace: Instant,
    nodes: Instant,
    status: Instant,
    polls: Instant,
    reopen: Instant,
}

/// The bus and the state of all nodes, pages and jobs.
pub(super) struct Pump {
    setup: Setup,
    bus: Result<Box<dyn Bus>, BusError>,
    orders: Sender<Order>,
    inbox: Receiver<Order>,
    outlets: Vec<Outlet>,
    time: BusTime,
    nodes: Nodes,
    live: Live,
    tracer: Tracer,
    pages: Pages,
    others: OtherClients,
    /// The transfers of all clients: on the default channels, and on the additional ones.
    transfers: [Transfers; 2],
    schedule: Schedule<Waiting>,
    running: Vec<Running>,
    count: Count,
    rate: Rate,
    peak: Peak,
    /// The load of the busiest tenth of the last second.
    busiest: Option<f64>,
    controller: Controller,
    /// Nodes whose PDO parameters were written, with the time of the last write.
    remapped: Vec<(NodeId, f64)>,
    /// The catalogues by vendor-ID and product code.
    catalogues: BTreeMap<(Option<u32>, Option<u32>), Arc<Catalogue>>,
    stimuli: Option<Json>,
    bit_rate: Option<u16>,
    looked: Instant,
    files: u64,
    due: Due,
}

impl Pump {
    /// A pump with an open bus; without one, the pump opens the bus itself.
    pub(super) fn new(
        setup: Setup,
        bus: Option<Box<dyn Bus>>,
        orders: Sender<Order>,
        inbox: Receiver<Order>,
    ) -> Pump {
        // The bit rate is known only of adapters that have to be told it. A simulator reports its bit rate later.
        let bit_rate = setup.options.known_bit_rate();
        Pump {
            setup,
            bus: bus.ok_or_else(|| BusError::Lost(std::io::ErrorKind::NotConnected.into())),
            orders,
            inbox,
            outlets: Vec::new(),
            time: BusTime::default(),
            nodes: Nodes::default(),
            live: Live::default(),
            tracer: Tracer::default(),
            pages: Pages::default(),
            others: OtherClients::default(),
            transfers: Default::default(),
            schedule: Schedule::default(),
            running: Vec::new(),
            count: Count::default(),
            rate: Rate::default(),
            peak: Peak::default(),
            busiest: None,
            controller: Controller::default(),
            remapped: Vec::new(),
            catalogues: BTreeMap::new(),
            stimuli: None,
            bit_rate,
            looked: clock::now(),
            files: 0,
            due: Due::default(),
        }
    }

    /// Runs until the process ends.
    pub(super) fn run(mut self) {
        loop {
            self.take_frames();
            if self.take_orders().is_err() {
                return;
            }
            self.begin_jobs();
            self.tick();
        }
    }

    fn now(&self) -> f64 {
        self.time.now(clock::now())
    }
}
