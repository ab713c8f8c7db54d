//! The thread that owns the bus. It distributes the received frames and starts the jobs that pages request.

mod due;
mod frames;
mod orders;
mod work;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Duration as StdDuration;

use canopen::{Duration, Frame, Instant, NodeId};
use page::{FromPage, Hub, PageId};
use serde_json::Value as Json;

use super::bus_time::BusTime;
use super::jobs::{self, Job, Learned};
use super::live::Live;
use super::nodes::Nodes;
use super::pages::Pages;
use super::port::Outlet;
use super::schedule::{Haste, Lane, Schedule};
use super::status::{Count, Rate};
use super::tracer::Tracer;
use crate::Catalogue;
use crate::bus::{Bus, BusError, clock};
use crate::cli::Options;

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

/// The version of the protocol with the pages.
const PROTOCOL: u32 = 1;

/// An order to the pump.
pub(super) enum Order {
    /// From a page.
    Page(FromPage),
    /// From a job: a port to pass frames to.
    Open(Outlet),
    /// From a job: a frame to send.
    Send(Frame),
    /// From a job: its progress.
    Progress(u64, Json),
    /// From a job: an event for all pages.
    Tell(Json),
    /// From a job: a fact about a node.
    Learned(NodeId, Learned),
    /// From a job: the result.
    Done(u64, Result<Json, Refusal>),
    /// From the simulator: a change of the stimuli.
    Stimuli(Json),
}

/// Why a request is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) text: String,
    /// The abort code of a node that has refused.
    pub(super) abort: Option<u32>,
}

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
    job: Job,
}

/// A running job.
struct Running {
    number: u64,
    asker: Option<Asker>,
    node: Option<NodeId>,
    is_update: bool,
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
    schedule: Schedule<Waiting>,
    running: Vec<Running>,
    count: Count,
    rate: Rate,
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
        let bit_rate = setup.options.bus.needs_bit_rate().then_some(setup.options.bit_rate);
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
            schedule: Schedule::default(),
            running: Vec::new(),
            count: Count::default(),
            rate: Rate::default(),
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
        if self.bus.is_ok() {
            self.scan();
        }
        loop {
            self.take_frames();
            if self.take_orders().is_err() {
                return;
            }
            self.begin_jobs();
            self.tick();
        }
    }

    /// Searches for nodes on the bus.
    fn scan(&mut self) {
        if !self.setup.silent {
            self.enqueue(None, Lane::Everything, Haste::Asked, None, jobs::scan());
        }
    }

    fn now(&self) -> f64 {
        self.time.now(clock::now())
    }
}

impl Refusal {
    pub(super) fn new(text: impl Into<String>) -> Refusal {
        Refusal { text: text.into(), abort: None }
    }
}
