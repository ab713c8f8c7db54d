//! The thread that has the bus: frames come in and are handed to all who want them; what pages ask for is begun here.

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

/// Frames that are taken before orders are looked at.
const AT_ONCE: usize = 512;
/// How long a quiet bus is listened to before orders are looked at: while jobs run they wait for their orders and not for frames.
const LISTEN: Duration = Duration(4000);
const PAUSE: StdDuration = StdDuration::from_micros(400);
/// Between two attempts to open a bus that is lost.
const REOPEN: Duration = Duration::from_millis(1000);
/// A node that has written nothing more to its PDO parameters for so long has a new mapping.
const SETTLED: f64 = 0.3;
/// A node that has not said what it is is asked again after so many seconds.
const ASK_AGAIN: f64 = 10.0;

/// The version of the messages.
const PROTOCOL: u32 = 1;

/// What the pump is told.
pub(super) enum Order {
    /// By a page.
    Page(FromPage),
    /// By a job: hand frames over.
    Open(Outlet),
    /// By a job: send this.
    Send(Frame),
    /// By a job: how far it is.
    Progress(u64, Json),
    /// By a job: an event for all pages.
    Tell(Json),
    /// By a job: what it has found out.
    Learned(NodeId, Learned),
    /// By a job: it is over.
    Done(u64, Result<Json, Refusal>),
    /// By the simulator.
    Stimuli(Json),
}

/// Why a request is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) text: String,
    /// The abort code of a node that has refused.
    pub(super) abort: Option<u32>,
}

/// Who waits for a job.
#[derive(Clone, Debug)]
struct Asker {
    page: PageId,
    id: Json,
}

/// A job that waits for its turn.
struct Waiting {
    asker: Option<Asker>,
    node: Option<NodeId>,
    job: Job,
}

/// A job that runs.
struct Running {
    number: u64,
    asker: Option<Asker>,
    node: Option<NodeId>,
    is_update: bool,
}

/// What the pump is started with.
pub(super) struct Setup {
    pub(super) options: Options,
    pub(super) silent: bool,
    pub(super) control: Option<std::net::SocketAddr>,
    pub(super) hub: Arc<Hub>,
}

/// When events are due.
#[derive(Default)]
struct Due {
    live: Instant,
    trace: Instant,
    nodes: Instant,
    status: Instant,
    polls: Instant,
    reopen: Instant,
}

/// The bus and all that is known of it.
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
    /// Nodes whose PDO parameters were written, and when.
    remapped: Vec<(NodeId, f64)>,
    /// By vendor-ID and product code.
    catalogues: BTreeMap<(Option<u32>, Option<u32>), Arc<Catalogue>>,
    stimuli: Option<Json>,
    bit_rate: Option<u16>,
    looked: Instant,
    files: u64,
    due: Due,
}

impl Pump {
    /// With a bus that is open, or will be.
    pub(super) fn new(
        setup: Setup,
        bus: Option<Box<dyn Bus>>,
        orders: Sender<Order>,
        inbox: Receiver<Order>,
    ) -> Pump {
        // Adapters that have a bit rate of their own do not tell it; a simulator does.
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

    /// Runs for as long as there are pages that could say something: until the process ends.
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

    /// Looks who is there.
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
