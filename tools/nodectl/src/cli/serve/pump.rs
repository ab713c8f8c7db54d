//! The thread that has the bus: frames come in and are handed to all who want them; what pages ask for is begun here.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration as StdDuration;

use canopen::{Duration, Frame, Instant, NodeId};
use page::{FromPage, Hub, PageId};
use serde_json::{Value as Json, json};

use super::bus_time::BusTime;
use super::jobs::{self, Job, Learned};
use super::live::{Key, Live};
use super::nodes::Nodes;
use super::pages::{Filter, Pages};
use super::port::Outlet;
use super::request::{self, What};
use super::schedule::{Haste, Lane, Schedule};
use super::status::{Count, Rate};
use super::tracer::Tracer;
use crate::bus::{Bus, BusError, Received, clock};
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

    // Frames.

    fn take_frames(&mut self) {
        let mut until = if self.outlets.is_empty() { clock::now() + LISTEN } else { clock::now() };
        for _ in 0..AT_ONCE {
            let Ok(bus) = &mut self.bus else { return };
            match bus.receive(until) {
                Ok(Some(received)) => self.on_frame(&received),
                Ok(None) => return,
                Err(error) => return self.lose(error),
            }
            until = clock::now();
        }
    }

    fn on_frame(&mut self, received: &Received) {
        let t = self.time.of_frame(received.at, clock::now());
        let frame = &received.frame;
        self.outlets.retain(|outlet| outlet.hand_over(received));
        self.count.add(frame);
        if let Some(news) = self.nodes.on_frame(frame, t) {
            self.on_news(frame, t);
            self.pages.tell(&self.setup.hub, &json!(news));
        }
        self.live.on_frame(frame, t);
        self.look_at_writes(frame, t);
        if self.pages.have_trace() {
            self.tracer.on_frame(frame, received.at, t, false);
        }
    }

    /// A node that boots may have another mapping.
    fn on_news(&mut self, frame: &Frame, t: f64) {
        let node = u8::try_from(frame.id() & 0x7F).ok().and_then(NodeId::new);
        if let (0x701..=0x77F, Some(node), [0]) = (frame.id(), node, frame.data()) {
            self.remapped.push((node, t));
        }
    }

    /// Somebody may write to PDO parameters of a node, this side or any other master.
    fn look_at_writes(&mut self, frame: &Frame, t: f64) {
        let node = frame.id().checked_sub(0x600).and_then(|id| NodeId::new(u8::try_from(id).ok()?));
        let (Some(node), &[command, low, high, ..]) = (node, frame.data()) else { return };
        // Initiate download, expedited or not (CiA 301, 7.2.4.3.3).
        if command >> 5 == 1 && (0x1800..0x1C00).contains(&u16::from_le_bytes([low, high])) {
            match self.remapped.iter_mut().find(|(other, _)| *other == node) {
                Some((_, since)) => *since = t,
                None => self.remapped.push((node, t)),
            }
        }
    }

    fn send(&mut self, frame: &Frame) {
        let Ok(bus) = &mut self.bus else { return };
        if let Err(error) = bus.send(frame) {
            return self.lose(error);
        }
        let (here, t) = (clock::now(), self.now());
        self.count.add(frame);
        self.look_at_writes(frame, t);
        if self.pages.have_trace() {
            self.tracer.on_frame(frame, here, t, true);
        }
    }

    /// The bus is gone: all jobs are told by their ports.
    fn lose(&mut self, error: BusError) {
        self.bus = Err(error);
        self.outlets.clear();
        self.due.reopen = clock::now() + REOPEN;
        self.due.status = clock::now();
    }

    fn reopen(&mut self) {
        let now = clock::now();
        if self.bus.is_ok() || now < self.due.reopen {
            return;
        }
        self.bus = self.setup.options.bus.open(self.setup.options.bit_rate);
        self.due.reopen = clock::now() + REOPEN;
        if self.bus.is_ok() {
            self.time.restart();
            self.due.status = now;
            self.scan();
        }
    }

    // Orders.

    /// An error when nobody can give orders any more.
    fn take_orders(&mut self) -> Result<(), RecvTimeoutError> {
        // Jobs wait for their orders to be carried out; without a bus there is nothing else to wait for.
        let pause = match &self.bus {
            Ok(_) if self.outlets.is_empty() => StdDuration::ZERO,
            Ok(_) => PAUSE,
            Err(_) => StdDuration::from_millis(20),
        };
        let mut next = self.inbox.recv_timeout(pause);
        for _ in 0..AT_ONCE {
            match next {
                Ok(order) => self.obey(order),
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(error) => return Err(error),
            }
            next = self.inbox.recv_timeout(StdDuration::ZERO);
        }
        next.map_or_else(
            |error| if error == RecvTimeoutError::Timeout { Ok(()) } else { Err(error) },
            |order| {
                self.obey(order);
                Ok(())
            },
        )
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Page(FromPage::Came { page, writes }) => self.welcome(page, writes),
            Order::Page(FromPage::Left { page }) => {
                self.pages.leave(page);
                self.live.want(self.pages.follows());
            }
            Order::Page(FromPage::Said { page, text }) => self.hear(page, &text),
            // Where there is no bus, the outlet is dropped, and the port tells the job.
            Order::Open(outlet) if self.bus.is_ok() => self.outlets.push(outlet),
            Order::Open(_) => {}
            Order::Send(frame) => self.send(&frame),
            Order::Progress(number, progress) => self.tell_progress(number, &progress),
            Order::Tell(event) => self.pages.tell(&self.setup.hub, &event),
            Order::Learned(node, learned) => self.learn(node, learned),
            Order::Done(number, result) => self.finish(number, result),
            Order::Stimuli(news) => self.on_stimuli(news),
        }
    }

    fn welcome(&mut self, page: PageId, writes: bool) {
        self.pages.come(page, writes);
        let hello = json!({
            "event": "hello", "protocol": PROTOCOL, "version": env!("CARGO_PKG_VERSION"),
            "bus": self.setup.options.bus.to_string(), "writes": writes,
            "simulator": self.setup.control.is_some(), "t": self.now(),
        });
        self.setup.hub.send(page, hello.to_string());
        self.setup.hub.send(page, self.nodes.all().to_string());
        self.due.status = clock::now();
    }

    fn hear(&mut self, page: PageId, text: &str) {
        let request = match request::parse(text) {
            Ok(request) => request,
            Err((id, reason)) => {
                self.setup.hub.send(page, json!({ "id": id, "error": reason }).to_string());
                if self.pages.get(page).is_some_and(super::pages::Page::mistake) {
                    self.setup.hub.close(page);
                }
                return;
            }
        };
        let Some(entry) = self.pages.get(page) else { return };
        let asker = Asker { page, id: request.id };
        if !entry.ask() {
            return self.answer_now(&asker, Err(Refusal::new("too many requests at once")));
        }
        if request.what.writes() && !entry.writes {
            let words = "read only: open the address that the terminal shows";
            return self.answer(&asker, Err(Refusal::new(words)));
        }
        match request.what.fault() {
            Some(fault) => self.answer(&asker, Err(Refusal::new(fault))),
            None => self.serve(asker, request.what),
        }
    }

    /// Answers at once what needs no bus, and makes a job of the rest.
    fn serve(&mut self, asker: Asker, what: What) {
        match what {
            What::Follow { signals } => {
                let result = self.follow(asker.page, &signals);
                self.answer(&asker, result);
            }
            What::Trace { on, kinds, nodes } => {
                let nodes = nodes.into_iter().filter_map(NodeId::new).collect();
                let filter = Filter { kinds: kinds.into_iter().map(|kind| kind.0).collect(), nodes };
                if let Some(page) = self.pages.get(asker.page) {
                    page.trace = on.then_some(filter);
                }
                self.answer(&asker, Ok(json!({})));
            }
            What::Stimuli => {
                let known = self.stimuli.clone();
                let result = known.ok_or_else(|| Refusal::new("no simulator is connected"));
                self.answer(&asker, result);
            }
            What::Signals { node } if self.live.survey(node.0).is_some() => {
                let signals = self.live.signals(node.0);
                self.answer(&asker, Ok(json!({ "signals": signals })));
            }
            what => self.make_job(asker, what),
        }
    }

    fn make_job(&mut self, asker: Asker, what: What) {
        let file = match &what {
            What::UpdateStart { file, .. } => {
                let kept = self.pages.get(asker.page).and_then(|page| page.file.take());
                kept.filter(|(number, _)| number == file).map(|(_, bytes)| bytes)
            }
            What::UpdateInspect { .. } => {
                self.files += 1;
                None
            }
            _ => None,
        };
        let means = jobs::Means { control: self.setup.control, file, number: self.files };
        let task = match jobs::task(what, means) {
            Ok(task) => task,
            Err(text) => return self.answer(&asker, Err(Refusal::new(text))),
        };
        if let Some((number, bytes)) = task.keeps {
            if let Some(page) = self.pages.get(asker.page) {
                page.file = Some((number, bytes));
            }
        }
        let updated = match task.lane {
            Lane::Node(node) => self.nodes.get(node).is_some_and(|node| node.updating).then_some(node),
            Lane::Everything => self.nodes.iter().find(|(_, node)| node.updating).map(|(node, _)| node),
            Lane::Lss | Lane::Nothing => None,
        };
        if let Some(node) = updated {
            let words = format!("node {} is being updated", node.get());
            return self.answer(&asker, Err(Refusal::new(words)));
        }
        let node = if let Lane::Node(node) = task.lane { Some(node) } else { None };
        if let Some(node) = node.filter(|_| task.job.is_update) {
            self.nodes.change(node).updating = true;
        }
        self.enqueue(Some(asker), task.lane, Haste::Asked, node, task.job);
    }

    fn follow(&mut self, page: PageId, signals: &[String]) -> Result<Json, Refusal> {
        const MOST: usize = 256;
        if signals.len() > MOST {
            return Err(Refusal::new(format!("{} signals; at most {MOST}", signals.len())));
        }
        let keys: Result<BTreeSet<Key>, String> = signals.iter().map(|signal| signal.parse()).collect();
        let keys = keys.map_err(Refusal::new)?;
        let known: Vec<Json> = keys.iter().filter_map(|key| self.live.describe(*key)).collect();
        if let Some(page) = self.pages.get(page) {
            page.follows = keys;
        }
        self.live.want(self.pages.follows());
        for node in self.live.wanted_nodes() {
            if self.live.survey(node).is_none() {
                self.survey(node);
            }
        }
        Ok(json!({ "signals": known }))
    }

    /// Finds out what a node sends, unless that is under way.
    fn survey(&mut self, node: NodeId) {
        if self.bus.is_ok() && !self.schedule.has(Lane::Node(node)) {
            self.enqueue(None, Lane::Node(node), Haste::Asked, Some(node), jobs::survey(node));
        }
    }

    // Jobs.

    fn enqueue(&mut self, asker: Option<Asker>, lane: Lane, haste: Haste, node: Option<NodeId>, job: Job) {
        self.schedule.add(lane, haste, Waiting { asker, node, job });
    }

    fn begin_jobs(&mut self) {
        while let Some((number, Waiting { asker, node, job })) = self.schedule.next() {
            self.running.push(Running { number, asker, node, is_update: job.is_update });
            let known = node.and_then(|node| self.nodes.get(node)?.catalogue.clone());
            jobs::begin(job, number, node.zip(known), &self.setup.options, &self.orders);
        }
    }

    fn tell_progress(&mut self, number: u64, progress: &Json) {
        let running = self.running.iter().find(|running| running.number == number);
        if let Some(Asker { page, id }) = running.and_then(|running| running.asker.as_ref()) {
            self.setup.hub.send(*page, json!({ "id": id, "progress": progress }).to_string());
        }
    }

    fn finish(&mut self, number: u64, result: Result<Json, Refusal>) {
        self.schedule.done(number);
        let Some(place) = self.running.iter().position(|running| running.number == number) else { return };
        let Running { asker, node, is_update, .. } = self.running.swap_remove(place);
        if let Some(node) = node.filter(|_| is_update) {
            let t = self.now();
            let entry = self.nodes.change(node);
            (entry.updating, entry.asked) = (false, None);
            self.remapped.push((node, t));
            let (step, key, value) = match &result {
                Ok(outcome) => ("done", "result", outcome.clone()),
                Err(refusal) => ("failed", "error", refusal.text.clone().into()),
            };
            let event = json!({ "event": "update", "node": node.get(), "step": step, key: value });
            self.pages.tell(&self.setup.hub, &event);
        }
        if let Some(asker) = asker {
            self.answer(&asker, result);
        }
    }

    /// Answers a request that was counted.
    fn answer(&mut self, asker: &Asker, result: Result<Json, Refusal>) {
        if let Some(page) = self.pages.get(asker.page) {
            page.answered();
        }
        self.answer_now(asker, result);
    }

    fn answer_now(&self, Asker { page, id }: &Asker, result: Result<Json, Refusal>) {
        let answer = match result {
            Ok(answer) => json!({ "id": id, "ok": answer }),
            Err(Refusal { text, abort: None }) => json!({ "id": id, "error": text }),
            Err(Refusal { text, abort }) => json!({ "id": id, "error": text, "abort": abort }),
        };
        self.setup.hub.send(*page, answer.to_string());
    }

    fn learn(&mut self, node: NodeId, learned: Learned) {
        match learned {
            Learned::Present => drop(self.nodes.change(node)),
            Learned::Identity(identity, catalogue) => {
                self.tracer.know(node, &catalogue);
                let entry = self.nodes.change(node);
                (entry.identity, entry.catalogue) = (Some(identity), Some(catalogue));
            }
            Learned::Catalogue(catalogue) => {
                self.tracer.know(node, &catalogue);
                self.nodes.change(node).catalogue = Some(catalogue);
            }
            Learned::Survey(survey, knowledge) => {
                self.tracer.learn(node, *knowledge);
                self.live.learn(node, survey);
                self.pages.tell(&self.setup.hub, &json!({ "event": "mapping", "node": node.get() }));
            }
            Learned::Reading(object, bytes) => {
                let t = self.now();
                self.live.on_reading(Key::new(node, object), t, &bytes);
            }
        }
    }

    fn on_stimuli(&mut self, mut news: Json) {
        self.bit_rate = news["bit_rate"].as_u64().and_then(|rate| u16::try_from(rate).ok()).or(self.bit_rate);
        self.stimuli = Some(news.clone());
        news["event"] = "stimuli".into();
        self.pages.tell(&self.setup.hub, &news);
    }

    // What is due.

    fn tick(&mut self) {
        self.reopen();
        let now = clock::now();
        if is_due(&mut self.due.live, now, 40) {
            let t = self.now();
            let (batches, lost) = self.live.take();
            self.pages.tell_samples(&self.setup.hub, t, &batches, lost);
        }
        if is_due(&mut self.due.trace, now, 50) {
            let (rows, lost) = self.tracer.take();
            self.pages.tell_rows(&self.setup.hub, &rows, lost);
        }
        if is_due(&mut self.due.nodes, now, 200) {
            self.look_at_nodes();
        }
        if is_due(&mut self.due.polls, now, 500) {
            self.poll();
        }
        if is_due(&mut self.due.status, now, 1000) {
            self.tell_status(now);
        }
    }

    fn look_at_nodes(&mut self) {
        let t = self.now();
        let settled: Vec<NodeId> =
            self.remapped.iter().filter(|(_, since)| t - since > SETTLED).map(|(node, _)| *node).collect();
        self.remapped.retain(|(node, _)| !settled.contains(node));
        for node in settled {
            if self.live.survey(node).is_some() {
                self.live.forget(node);
                self.survey(node);
            }
        }
        self.identify(t);
        let changed = self.nodes.changed().map(|rows| rows.to_string());
        self.pages.tell_nodes(&self.setup.hub, changed.as_deref(), || self.nodes.all().to_string());
    }

    /// Asks the nodes that were heard and not asked yet what they are.
    fn identify(&mut self, t: f64) {
        if self.setup.silent || self.bus.is_err() {
            return;
        }
        let is_to_be_asked = |entry: &super::nodes::Node| {
            let is_deaf = entry.state() == Some(canopen::nmt::State::Stopped) || entry.updating;
            let is_new = entry.asked.is_none_or(|asked| entry.identity.is_none() && t - asked > ASK_AGAIN);
            entry.is_alive() && is_new && !is_deaf
        };
        let unknown: Vec<NodeId> =
            self.nodes.iter().filter(|(_, entry)| is_to_be_asked(entry)).map(|(node, _)| node).collect();
        for node in unknown {
            self.nodes.change(node).asked = Some(t);
            self.enqueue(None, Lane::Node(node), Haste::Background, Some(node), jobs::identify(node));
        }
    }

    /// Reads the followed signals that are in no TPDO, and surveys what could not be before.
    fn poll(&mut self) {
        for node in self.live.wanted_nodes() {
            let is_free = !self.schedule.has(Lane::Node(node));
            if !is_free || self.bus.is_err() || !self.nodes.get(node).is_some_and(|node| node.is_alive()) {
                continue;
            }
            if self.live.survey(node).is_none() {
                self.survey(node);
                continue;
            }
            let objects = self.live.polled(node);
            if !objects.is_empty() {
                let job = jobs::poll(node, objects);
                self.enqueue(None, Lane::Node(node), Haste::Background, Some(node), job);
            }
        }
    }

    fn tell_status(&mut self, now: Instant) {
        #[allow(clippy::cast_precision_loss)]
        let seconds = now.0.saturating_sub(self.looked.0) as f64 / 1e6;
        let t = self.now();
        let reason = self.bus.as_ref().err().map(ToString::to_string);
        // A second look at once (somebody has come) would count next to nothing.
        if seconds > 0.5 {
            self.looked = now;
            self.nodes.look(t, seconds, self.bit_rate);
            self.rate = self.count.rate(seconds);
        }
        for (page, entry) in self.pages.iter().filter(|(page, _)| self.setup.hub.has_room(*page)) {
            let status = json!({
                "event": "status", "t": t, "open": self.bus.is_ok(), "reason": reason, "bit_rate": self.bit_rate,
                "load": self.rate.load(self.bit_rate), "frames": self.rate.frames, "total": self.count.total,
                "pages": self.pages.count(), "lost": entry.lost(),
            });
            self.setup.hub.send(page, status.to_string());
        }
    }
}

impl Refusal {
    pub(super) fn new(text: impl Into<String>) -> Refusal {
        Refusal { text: text.into(), abort: None }
    }
}

/// Whether an event is due; the next one is so many milliseconds after it.
fn is_due(due: &mut Instant, now: Instant, period: u64) -> bool {
    let is_due = now >= *due;
    if is_due {
        *due = now + Duration::from_millis(period);
    }
    is_due
}
