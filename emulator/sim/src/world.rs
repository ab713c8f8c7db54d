//! The simulation: boards, the bus and everything else that is wired to it, in one virtual time.
//!
//! The loop is the one that the documentation of [`canbus`] describes. With one board it is exact; with several,
//! a board may be ahead of a start of frame by less than the shortest frame, too little to miss anything of it.

use std::time::Instant;

use canbus::{Babbler, Bus, Controller, Event, Frame, HostNode, Stamped, StandardId, Time};
use chip::Stm32f4;
use emulator::Machine;

use crate::board::Board;
use crate::host_time::{HostTime, Work};
use crate::log::Line;
use crate::port::Port;
use crate::retuning::Retuning;
use crate::status::{Status, share};
use crate::stimuli::{BoardStimuli, Stimulus, Targeted};
use crate::summary::{BusSummary, Summary};
use crate::traffic::Traffic;

/// Any number of bits is causal up to this one, which is less than the shortest frame has.
const QUANTUM_BITS: u64 = 43;
/// Of the foreign traffic: any number will do, the same one gives the same traffic.
const SEED: u64 = 1;

/// Names a place on the bus for a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortId(usize);

/// A stimulus is for a board that is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no node {0} here")]
pub struct NoSuchBoard(pub u8);

/// Boards, a bus, foreign traffic and clients.
pub struct World {
    now: Time,
    bit_rate: u16,
    bit: Time,
    bus: Bus,
    boards: Vec<Board>,
    /// The adapter of the machine that everything runs on. It acknowledges frames also when no client is there,
    /// for a board alone on its bus could send nothing, and is the NMT master then.
    host: HostNode,
    load: Option<Babbler>,
    /// Places are used again but never given up: the bus knows its participants by their order.
    ports: Vec<Place>,
    records: Records,
    /// Measured only for who asks: the clock of the host costs time as well.
    host_time: Option<HostTime>,
    enforces_rules: bool,
    stimuli_changes: u64,
}

/// A port and whether a client has it.
#[derive(Default)]
struct Place {
    port: Port,
    taken: bool,
    /// A client that leaves the start of the nodes to the host.
    only_looks: bool,
}

/// What was seen of the bus.
#[derive(Default)]
struct Records {
    traffic: Traffic,
    frames: Vec<Stamped>,
    log: Vec<Line>,
    /// Nodes whose boot-up was heard since the last look.
    booted: Vec<u8>,
    /// The node-ID of each board: that of the command line until it boots with another one, which it has by LSS or from its
    /// flash.
    node_ids: Vec<u8>,
    retuning: Retuning,
    good: u64,
    bad: u64,
}

impl World {
    /// Boards on a bus that runs at `bit_rate` (kbit/s), with `load` percent of foreign traffic.
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
            boards,
            host,
            load,
            ports: Vec::new(),
            records,
            host_time: None,
            enforces_rules: false,
            stimuli_changes: 0,
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

    /// The machine of a board, in the order of the command line, for a test that breaks it.
    ///
    /// # Panics
    /// Without such a board.
    pub fn machine(&mut self, index: usize) -> &mut Machine<Stm32f4> {
        self.boards[index].machine()
    }

    /// The bus, for bit errors.
    pub fn bus(&mut self) -> &mut Bus {
        &mut self.bus
    }

    /// A place on the bus for a client; it takes part once it is attached.
    pub fn open_port(&mut self) -> PortId {
        self.open(false)
    }

    /// The same for a client that does not start the nodes, as masters do: the page in the browser.
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

    /// The place of a client.
    pub fn port(&mut self, id: PortId) -> &mut Port {
        &mut self.ports[id.0].port
    }

    /// The client is gone, with all that it had still to send.
    pub fn close_port(&mut self, id: PortId) {
        self.ports[id.0] = Place::default();
    }

    /// Gives the boards another stimulus from now on.
    ///
    /// # Errors
    /// When the board that is meant is not there.
    pub fn apply(&mut self, stimulus: &Targeted<Stimulus>) -> Result<(), NoSuchBoard> {
        let mut meant = self.boards.iter_mut().filter(|board| stimulus.is_for(board.id())).peekable();
        if let (None, Some(node)) = (meant.peek(), stimulus.node) {
            return Err(NoSuchBoard(node));
        }
        meant.for_each(|board| board.apply(&stimulus.what, self.now));
        self.stimuli_changes += 1;
        Ok(())
    }

    /// What the sensors of each board see, in the order of the command line.
    pub fn stimuli(&self) -> Vec<BoardStimuli> {
        self.boards.iter().zip(&self.records.node_ids).map(|(board, &id)| board.stimuli(id)).collect()
    }

    /// How often a stimulus was changed.
    pub fn stimuli_changes(&self) -> u64 {
        self.stimuli_changes
    }

    /// Lets everything up to `end` happen.
    ///
    /// # Panics
    /// When a program has broken a rule of its chip after [`World::enforce_rules`].
    pub fn run_until(&mut self, end: Time) {
        loop {
            let start = self.host_time.is_some().then(Instant::now);
            let next = self.step_bus().min(self.start_nodes()).min(self.retune());
            if self.now >= end {
                break;
            }
            let quantum =
                if self.boards.len() > 1 { self.now + self.bit * QUANTUM_BITS } else { Time::NEVER };
            let start = self.measure(Work::Bus, start);
            let mut limit = end.min(next).min(quantum);
            for board in &mut self.boards {
                limit = limit.min(board.run_until(limit));
            }
            self.measure(Work::Boards, start);
            self.now = limit;
        }
        while self.host.receive().is_some() {}
        self.boards.iter_mut().for_each(|board| board.read_log(&mut self.records.log));
        if self.enforces_rules && self.boards.iter().any(Board::has_broken_rules) {
            let broken: Vec<String> = self.boards.iter().flat_map(Board::broken_rules).collect();
            panic!("a rule of the chip is broken: {}", broken.join("; "));
        }
    }

    /// From now on a broken rule of the chip fails the test, or is only told by the summary: for a test that breaks one itself.
    pub fn enforce_rules(&mut self, on: bool) {
        self.enforces_rules = on;
    }

    /// Measures from now on what the host's time goes to.
    pub fn measure_host_time(&mut self) {
        self.host_time = Some(HostTime::default());
    }

    /// What the host's time went to since that is measured.
    pub fn host_time(&self) -> Option<HostTime> {
        self.host_time
    }

    fn measure(&mut self, work: Work, start: Option<Instant>) -> Option<Instant> {
        Some(self.host_time.as_mut()?.count(work, start?))
    }

    /// Lets the bus catch up with the boards; returns when something will next happen on it.
    fn step_bus(&mut self) -> Time {
        let boards = self.boards.iter_mut().map(|board| board.controller());
        let load = self.load.iter_mut().map(|load| load as &mut dyn Controller);
        let ports = self.ports.iter_mut().map(|place| &mut place.port as &mut dyn Controller);
        let host = std::iter::once(&mut self.host as &mut dyn Controller);
        let mut participants: Vec<&mut dyn Controller> =
            boards.chain(host).chain(load).chain(ports).collect();
        let records = &mut self.records;
        self.bus.step(&mut participants, self.now, &mut |event| records.on_event(&event))
    }

    /// Starts the nodes that have booted while there was no client that could do it. Returns when the bus has to
    /// look at the request: now, if there is one.
    fn start_nodes(&mut self) -> Time {
        let booted = std::mem::take(&mut self.records.booted);
        if booted.is_empty() || self.ports.iter().any(|place| place.taken && !place.only_looks) {
            return Time::NEVER;
        }
        booted.iter().for_each(|&node| self.host.send(start_command(node), self.now));
        self.now
    }

    /// Sets the host's adapters to the bit rate that LSS has activated. Returns when that will be the case.
    fn retune(&mut self) -> Time {
        if let Some(kbit) = self.records.retuning.take(self.now) {
            self.bit_rate = kbit;
            self.bit = Time::of_cycle(u64::from(kbit) * 1000);
            self.host.set_bit(self.bit);
            self.ports.iter_mut().for_each(|place| place.port.set_bit(self.bit));
        }
        self.records.retuning.due()
    }

    /// The frames since the last call, each with the end of its end of frame.
    pub fn take_frames(&mut self) -> Vec<Stamped> {
        std::mem::take(&mut self.records.frames)
    }

    /// The boards' log since the last call.
    pub fn take_log(&mut self) -> Vec<Line> {
        std::mem::take(&mut self.records.log)
    }

    /// What the bus tells of the nodes.
    pub fn traffic(&self) -> &Traffic {
        &self.records.traffic
    }

    /// The present state of everything.
    pub fn status(&self) -> Status {
        let nodes = self.boards.iter().zip(&self.records.node_ids);
        let nodes = nodes.map(|(board, &id)| board.status(id, self.records.traffic.node(id)));
        Status { at: self.now, bus_busy: self.bus.busy(self.now), nodes: nodes.collect() }
    }

    /// What can be said of the whole run, which took the host `host_seconds`.
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
