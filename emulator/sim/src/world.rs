//! The simulation: boards, the bus and all other participants of the bus, in one virtual time.
//!
//! The loop follows the documentation of [`canbus`]. With one board the simulation is exact. With several boards, a
//! board may be ahead of a start of frame by less than the shortest frame, so that it misses no event of the frame. So
//! between two events of the bus the boards depend on nothing but themselves, and run on several threads.

use std::num::NonZeroUsize;
use std::time::Instant;

use canbus::{Babbler, Bus, Controller, Event, Frame, HostNode, Stamped, StandardId, Time};
use chip::Stm32f4;
use emulator::{Incident, Machine};

use crate::board::{Board, Turn};
use crate::crew::Crew;
use crate::host_time::{HostTime, Work};
use crate::log::Line;
use crate::port::Port;
use crate::retuning::Retuning;
use crate::status::{Status, share};
use crate::stimuli::{BoardStimuli, Stimulus, Targeted};
use crate::summary::{BusSummary, Summary};
use crate::traffic::Traffic;

/// The longest quantum in bits without a missed event: less than the bits of the shortest frame.
const QUANTUM_BITS: u64 = 43;
/// The seed of the foreign traffic: any number will do, and the same number gives the same traffic.
const SEED: u64 = 1;

/// Identifies a client's port on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortId(usize);

/// A stimulus is addressed to a board that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no node {0} here")]
pub struct NoSuchBoard(pub u8);

/// Listens to the bus and to the boards.
pub trait Observer {
    /// The bus has this bit rate from now on, in bit/s.
    fn bit_rate(&mut self, bits_per_second: u32);
    /// A frame has ended. `board`: its sender, in the order of the command line; `None` for any other participant.
    fn frame(&mut self, at: Time, frame: &Frame, board: Option<usize>);
    /// A frame that began at `start` has failed for its sender, which sends it again. Others may have received it.
    fn failed(&mut self, start: Time, frame: &Frame, board: Option<usize>);
    /// An incident of a board.
    fn incident(&mut self, at: Time, board: usize, incident: &Incident);
    /// A board was switched on or off.
    fn power(&mut self, at: Time, board: usize, is_on: bool);
    /// A test may change the machine of a board.
    fn touched(&mut self, at: Time, board: usize);
    /// The boards have reached this time.
    fn time(&mut self, at: Time);
}

/// Boards, a bus, foreign traffic and clients.
pub struct World {
    now: Time,
    bit_rate: u16,
    bit: Time,
    bus: Bus,
    boards: Vec<Board>,
    crew: Crew,
    /// The adapter of the host. It acknowledges frames even without a client, because a board alone on its bus could
    /// send nothing. Without a client, it is also the NMT master.
    host: HostNode,
    load: Option<Babbler>,
    /// Ports are reused but never removed: the bus identifies its participants by their order.
    ports: Vec<Place>,
    records: Records,
    /// Measured only on request, because reading the host's clock costs time.
    host_time: Option<HostTime>,
    enforces_rules: bool,
    stimuli_changes: u64,
    observer: Option<Box<dyn Observer>>,
    /// The observer's knowledge of each board.
    observed: Vec<Observed>,
}

/// An observer's knowledge of a board.
#[derive(Clone, Copy)]
struct Observed {
    incidents: usize,
    power_ons: u64,
    is_powered: bool,
}

/// A port, and whether a client uses it.
#[derive(Default)]
struct Place {
    port: Port,
    taken: bool,
    /// A client that does not start nodes, so that the host starts them.
    only_looks: bool,
}

/// The observations of the bus and the logs.
#[derive(Default)]
struct Records {
    traffic: Traffic,
    frames: Vec<Stamped>,
    log: Vec<Line>,
    /// Nodes that have booted since the last step.
    booted: Vec<u8>,
    /// The node-ID of each board: that of the command line until the board boots with another one, set by LSS or kept
    /// in its flash.
    node_ids: Vec<u8>,
    retuning: Retuning,
    good: u64,
    bad: u64,
}

impl World {
    /// A world with boards on a bus at `bit_rate` (kbit/s), with `load` percent of foreign traffic.
    pub fn new(boards: Vec<Board>, bit_rate: u16, load: u8) -> World {
        let bit = Time::of_cycle(u64::from(bit_rate) * 1000);
        let load = (load > 0).then(|| Babbler::new(bit, f64::from(load) / 100.0, Babbler::foreign(), SEED));
        let node_ids = boards.iter().map(Board::id).collect();
        let records = Records { node_ids, ..Records::default() };
        let (bus, host) = (Bus::new(), HostNode::new(bit));
        World {
            now: Time::ZERO,
            bit_rate,
            bit,
            bus,
            crew: Crew::default(),
            boards,
            host,
            load,
            ports: Vec::new(),
            records,
            host_time: None,
            enforces_rules: false,
            stimuli_changes: 0,
            observer: None,
            observed: Vec::new(),
        }
    }

    /// Shows an observer everything from now on, or nothing.
    pub fn observe(&mut self, observer: Option<Box<dyn Observer>>) {
        self.observed = self.boards.iter().map(Observed::of).collect();
        self.observer = observer;
        let bit_rate = self.bit_rate();
        if let Some(observer) = &mut self.observer {
            observer.bit_rate(bit_rate);
        }
    }

    /// Virtual time.
    pub fn now(&self) -> Time {
        self.now
    }

    /// The bit rate of the host's adapters in bit/s.
    pub fn bit_rate(&self) -> u32 {
        u32::from(self.bit_rate) * 1000
    }

    /// The boards, in the order of the command line.
    pub fn boards(&self) -> &[Board] {
        &self.boards
    }

    /// The machine of a board, in the order of the command line, for a test that injects faults.
    ///
    /// # Panics
    /// When the board does not exist.
    pub fn machine(&mut self, index: usize) -> &mut Machine<Stm32f4> {
        if let Some(observer) = &mut self.observer {
            observer.touched(self.now, index);
        }
        self.boards[index].machine()
    }

    /// Number of wrong reads of the flash of a board, with a supply that is too low for the clock.
    pub fn bad_reads(&self, index: usize) -> u64 {
        self.boards.get(index).map_or(0, Board::bad_reads)
    }

    /// The bus, for the injection of bit errors.
    pub fn bus(&mut self) -> &mut Bus {
        &mut self.bus
    }

    /// A port on the bus for a client; it is inactive until an adapter is attached.
    pub fn open_port(&mut self) -> PortId {
        self.open(false)
    }

    /// A port for a client that does not start the nodes, unlike a master: the page in the browser.
    pub fn open_looking_port(&mut self) -> PortId {
        self.open(true)
    }

    fn open(&mut self, only_looks: bool) -> PortId {
        let index = self.ports.iter().position(|place| !place.taken).unwrap_or(self.ports.len());
        if index == self.ports.len() {
            self.ports.push(Place::default());
        }
        (self.ports[index].taken, self.ports[index].only_looks) = (true, only_looks);
        PortId(index)
    }

    /// The port of a client.
    pub fn port(&mut self, id: PortId) -> &mut Port {
        &mut self.ports[id.0].port
    }

    /// Closes the port of a client and drops its waiting frames.
    pub fn close_port(&mut self, id: PortId) {
        self.ports[id.0] = Place::default();
    }

    /// Applies a stimulus to the boards, from now on.
    ///
    /// # Errors
    /// When the addressed board does not exist.
    pub fn apply(&mut self, stimulus: &Targeted<Stimulus>) -> Result<(), NoSuchBoard> {
        let mut meant = self.boards.iter_mut().filter(|board| stimulus.is_for(board.id())).peekable();
        if let (None, Some(node)) = (meant.peek(), stimulus.node) {
            return Err(NoSuchBoard(node));
        }
        meant.for_each(|board| board.apply(&stimulus.what, self.now));
        self.stimuli_changes += 1;
        Ok(())
    }

    /// The stimuli of each board, in the order of the command line.
    pub fn stimuli(&self) -> Vec<BoardStimuli> {
        self.boards.iter().zip(&self.records.node_ids).map(|(board, &id)| board.stimuli(id)).collect()
    }

    /// Number of stimuli applied so far.
    pub fn stimuli_changes(&self) -> u64 {
        self.stimuli_changes
    }

    /// Runs the simulation to `end`.
    ///
    /// # Panics
    /// When a program has broken a rule of its chip and [`World::enforce_rules`] is on.
    pub fn run_until(&mut self, end: Time) {
        loop {
            let start = self.host_time.is_some().then(Instant::now);
            let next = self.step_bus().min(self.start_nodes()).min(self.retune());
            if self.now >= end {
                break;
            }
            self.show_incidents();
            let turn = Turn {
                limit: end.min(next).min(self.horizon()),
                bus_is_busy: self.bus.is_busy(),
                is_measured: start.is_some(),
            };
            let mut start = self.measure(Work::Bus, start);
            let host_time = &mut self.host_time;
            let rested =
                || start = host_time.as_mut().zip(start).map(|(it, start)| it.count(Work::Boards, start));
            self.now = self.crew.run(&mut self.boards, turn, rested);
            self.measure(Work::Waiting, start);
        }
        while self.host.receive().is_some() {}
        if let Some(observer) = &mut self.observer {
            observer.time(self.now);
        }
        self.boards.iter_mut().for_each(|board| board.read_log(&mut self.records.log));
        if self.enforces_rules && self.boards.iter().any(Board::has_broken_rules) {
            let broken: Vec<String> = self.boards.iter().flat_map(Board::broken_rules).collect();
            panic!("a rule of the chip is broken: {}", broken.join("; "));
        }
    }

    /// How far the boards may run before they see each other. On an idle bus a board can begin a frame at its next event,
    /// and the others notice that a quantum later. A frame on the wire ends at an event of the bus.
    fn horizon(&self) -> Time {
        if self.boards.len() < 2 || self.bus.is_busy() {
            return Time::NEVER;
        }
        let earliest = self.boards.iter().map(Board::next_event).min();
        earliest.map_or(Time::NEVER, |earliest| earliest.max(self.now) + self.bit * QUANTUM_BITS)
    }

    /// Runs the boards on at most this many threads, instead of on one. The run is the same with any number.
    pub fn set_threads(&mut self, count: NonZeroUsize) {
        // A thread needs a board to run.
        self.crew = Crew::new(count.get().min(self.boards.len()));
    }

    /// Sets whether a broken rule of the chip panics, or is only reported in the summary. A test that breaks a rule on
    /// purpose turns this off.
    pub fn enforce_rules(&mut self, on: bool) {
        self.enforces_rules = on;
    }

    /// Starts to measure the host's time by kind of work.
    pub fn measure_host_time(&mut self) {
        self.host_time = Some(HostTime::default());
    }

    /// The host's time by kind of work since the start of the measurement.
    pub fn host_time(&self) -> Option<HostTime> {
        self.host_time
    }

    fn measure(&mut self, work: Work, start: Option<Instant>) -> Option<Instant> {
        Some(self.host_time.as_mut()?.count(work, start?))
    }

    /// Brings the bus up to the time of the boards; returns the instant of its next event.
    fn step_bus(&mut self) -> Time {
        let boards = self.boards.iter_mut().map(|board| board.controller());
        let load = self.load.iter_mut().map(|load| load as &mut dyn Controller);
        let ports = self.ports.iter_mut().map(|place| &mut place.port as &mut dyn Controller);
        let host = std::iter::once(&mut self.host as &mut dyn Controller);
        let mut participants: Vec<&mut dyn Controller> =
            boards.chain(host).chain(load).chain(ports).collect();
        let (records, observer, count) = (&mut self.records, &mut self.observer, self.observed.len());
        self.bus.step(&mut participants, self.now, &mut |event| {
            records.on_event(&event);
            let Some(observer) = observer.as_mut() else { return };
            let board = |transmitter| Some(transmitter).filter(|transmitter| *transmitter < count);
            match event {
                Event::Frame { end, frame, transmitter, .. } => {
                    observer.frame(end, &frame, board(transmitter));
                }
                Event::Error { start, frame, transmitter, .. } => {
                    observer.failed(start, &frame, board(transmitter));
                }
            }
        })
    }

    fn show_incidents(&mut self) {
        let Some(observer) = &mut self.observer else { return };
        for (number, (board, known)) in self.boards.iter().zip(&mut self.observed).enumerate() {
            if known.power_ons != board.power_ons() {
                observer.power(self.now, number, true);
            }
            if known.is_powered && !board.is_powered() {
                observer.power(self.now, number, false);
            }
            (known.power_ons, known.is_powered) = (board.power_ons(), board.is_powered());
            for (at, incident) in board.incidents().iter().skip(known.incidents) {
                observer.incident(*at, number, incident);
                known.incidents += 1;
            }
        }
    }

    /// Starts the nodes that have booted while no client was there to start them. Returns the instant at which the bus
    /// must look at the request: now, or never without a request.
    fn start_nodes(&mut self) -> Time {
        let booted = std::mem::take(&mut self.records.booted);
        if booted.is_empty() || self.ports.iter().any(|place| place.taken && !place.only_looks) {
            return Time::NEVER;
        }
        booted.iter().for_each(|&node| self.host.send(start_command(node), self.now));
        self.now
    }

    /// Sets the host's adapters to the bit rate that LSS has activated. Returns the instant of the next change.
    fn retune(&mut self) -> Time {
        if let Some(kbit) = self.records.retuning.take(self.now) {
            self.bit_rate = kbit;
            self.bit = Time::of_cycle(u64::from(kbit) * 1000);
            self.host.set_bit(self.bit);
            self.ports.iter_mut().for_each(|place| place.port.set_bit(self.bit));
            let bit_rate = self.bit_rate();
            if let Some(observer) = &mut self.observer {
                observer.bit_rate(bit_rate);
            }
        }
        self.records.retuning.due()
    }

    /// The frames since the last call, each with the end of its end of frame.
    pub fn take_frames(&mut self) -> Vec<Stamped> {
        std::mem::take(&mut self.records.frames)
    }

    /// The log lines of all boards since the last call.
    pub fn take_log(&mut self) -> Vec<Line> {
        std::mem::take(&mut self.records.log)
    }

    /// The observations of the nodes on the bus.
    pub fn traffic(&self) -> &Traffic {
        &self.records.traffic
    }

    /// The current state of the simulation.
    pub fn status(&self) -> Status {
        let nodes = self.boards.iter().zip(&self.records.node_ids);
        let nodes = nodes.map(|(board, &id)| board.status(id, self.records.traffic.node(id)));
        Status { at: self.now, bus_busy: self.bus.busy(self.now), nodes: nodes.collect() }
    }

    /// The summary of the run; `host_seconds` is its duration on the host.
    pub fn summary(&self, host_seconds: f64, lost_by_clients: u64) -> Summary {
        let bus = BusSummary {
            bit_rate: self.bit_rate,
            frames: self.records.good,
            errors: self.records.bad,
            load: share(self.bus.busy(self.now), self.now),
            lost_by_clients,
        };
        let nodes = self.boards.iter().zip(&self.records.node_ids);
        let nodes = nodes.map(|(board, &id)| board.summary(self.records.traffic.node(id)));
        Summary {
            virtual_seconds: self.now.as_secs_f64(),
            host_seconds,
            bus,
            nodes: nodes.collect(),
            host_time: self.host_time,
        }
    }
}

impl Observed {
    /// The present supply, and no incident.
    fn of(board: &Board) -> Observed {
        Observed { incidents: 0, power_ons: board.power_ons(), is_powered: board.is_powered() }
    }
}

impl Records {
    fn on_event(&mut self, event: &Event) {
        match event {
            &Event::Frame { end: at, frame, transmitter, .. } => {
                self.good += 1;
                let booted = self.traffic.on_frame(&frame);
                if let (Some(node), Some(id)) = (booted, self.node_ids.get_mut(transmitter)) {
                    *id = node;
                }
                self.booted.extend(booted);
                self.retuning.on_frame(&frame, at);
                self.frames.push(Stamped { at, frame });
            }
            Event::Error { .. } => self.bad += 1,
        }
    }
}

/// NMT: start this node (CiA 301, 7.2.8.3.1.1).
fn start_command(node: u8) -> Frame {
    Frame::data(StandardId::ZERO, &[1, node]).unwrap_or_else(|| unreachable!("two bytes fit"))
}
