//! Stations and one master on one bus, in virtual time: every run of a test is the same.

mod disturbance;
mod port;
mod station;

use std::collections::VecDeque;

use canbus::{Bus, Controller, Event, HostNode, Id, Stamped, StandardId, Time};
use canopen::{Duration, Frame, Instant};
use monitor::Sender;

use crate::sdo::Channel;
use crate::watch::Watch;

pub use disturbance::{Disturbance, Tally};
pub use port::{Port, from_bus, to_bus};
pub use station::{Station, Unit};

/// The time-out of the master for an SDO response.
const TIME_OUT: Duration = Duration::from_millis(500);

/// The counters of a bus analyser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Frames that at least one participant has received.
    pub frames: u64,
    /// Error frames.
    pub errors: u64,
}

/// A bus with stations and a master. A monitor listens to it.
#[derive(Debug)]
pub struct Network<U> {
    bus: Bus,
    now: Time,
    /// The stations.
    pub stations: Vec<Station<U>>,
    master: HostNode,
    /// The frames that the master has received and no test has taken yet.
    heard: VecDeque<Stamped>,
    disturbance: Option<Disturbance>,
    traffic: Traffic,
    watch: Watch,
}

impl<U: Unit> Network<U> {
    /// A bus at 1 Mbit/s with these units, all silent until [`start`](Network::start).
    pub fn new(units: impl IntoIterator<Item = U>) -> Network<U> {
        Network::at(1000, units)
    }

    /// A bus at a bit rate in kbit/s.
    pub fn at(kbit: u16, units: impl IntoIterator<Item = U>) -> Network<U> {
        let bits_per_second = u32::from(kbit) * 1000;
        let bit = Time::of_cycle(bits_per_second.into());
        let units = units.into_iter().enumerate();
        Network {
            bus: Bus::new(),
            now: Time::ZERO,
            stations: units.map(|(number, unit)| Station::new(unit, Port::new(bit), number)).collect(),
            master: HostNode::new(bit),
            heard: VecDeque::new(),
            disturbance: None,
            traffic: Traffic::default(),
            watch: Watch::of_bus(bits_per_second),
        }
    }

    /// A bus on which frames are destroyed, repeated and delayed.
    #[must_use]
    pub fn disturbed(mut self, disturbance: Disturbance) -> Network<U> {
        self.disturbance = Some(disturbance);
        self
    }

    /// The SDO servers get the requests on the bus only, none of the monitor.
    #[must_use]
    pub fn without_reads(mut self) -> Network<U> {
        self.watch.read_nothing();
        self
    }

    /// Power-on, for all stations at once.
    pub fn start(&mut self) {
        let now = self.instant();
        self.stations.iter_mut().for_each(|station| station.start(now, &mut self.watch));
    }

    /// The current time of the bus.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }

    fn instant(&self) -> Instant {
        Instant(self.now.as_micros())
    }

    /// The counters.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// The numbers of disturbances so far.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.disturbance.as_ref().map(Disturbance::tally).unwrap_or_default()
    }

    /// The time in which the bus was busy.
    #[must_use]
    pub fn busy(&self) -> Time {
        self.bus.busy(self.now)
    }

    /// Sends a frame from the master.
    pub fn send(&mut self, frame: &Frame) {
        self.master.send(to_bus(frame), self.now);
    }

    /// Sends a frame from the master and waits until the frame is on the bus.
    ///
    /// # Panics
    /// When the bus does not take the frame within a second.
    pub fn transmit(&mut self, frame: &Frame) {
        self.send(frame);
        let end = self.now + Time::from_millis(1000);
        while self.master.backlog() > 0 {
            assert!(self.now < end, "the bus is stuck");
            self.step(end);
        }
    }

    /// The oldest frame that the master has received and no test has taken yet.
    pub fn hear(&mut self) -> Option<Stamped> {
        self.heard.pop_front()
    }

    /// Like [`hear`](Network::hear), for one identifier. Frames with other identifiers stay.
    pub fn hear_id(&mut self, id: u16) -> Option<Frame> {
        let id = StandardId::new(id).map(Id::from);
        let place = self.heard.iter().position(|heard| Some(heard.frame.id()) == id)?;
        self.heard.remove(place).and_then(|heard| from_bus(&heard.frame))
    }

    /// Waits for a frame with this identifier, for `span` at most.
    pub fn await_id(&mut self, id: u16, span: Duration) -> Option<Frame> {
        let end = self.now + Time::from_micros(span.0);
        loop {
            let frame = self.hear_id(id);
            if frame.is_some() || self.now >= end {
                return frame;
            }
            self.step(end);
        }
    }

    /// Lets time pass.
    pub fn run(&mut self, span: Duration) {
        let end = self.now + Time::from_micros(span.0);
        while self.now < end {
            self.step(end);
        }
    }

    /// Processes everything that is due now and advances to the next event, at most to `end`.
    pub fn step(&mut self, end: Time) {
        let now = self.instant();
        for station in self.stations.iter_mut().filter(|station| station.due() <= now) {
            station.run(now, &mut self.watch);
            station.port.pump(self.now);
        }
        let next = self.step_bus();
        let due = self.stations.iter().map(Station::due).min().unwrap_or(Instant::NEVER);
        let due = if due == Instant::NEVER { Time::NEVER } else { Time::from_micros(due.0) };
        self.now = next.min(due).max(self.now).min(end);
    }

    fn step_bus(&mut self) -> Time {
        if let Some(disturbance) = &mut self.disturbance {
            disturbance.prepare(&mut self.bus, self.stations.len(), self.now);
        }
        let count = self.stations.len();
        let ports = self.stations.iter_mut().map(|station| &mut station.port as &mut dyn Controller);
        let others = [&mut self.master as &mut dyn Controller];
        let burst =
            self.disturbance.as_mut().map(|disturbance| &mut disturbance.burst as &mut dyn Controller);
        let mut participants: Vec<&mut dyn Controller> = ports.chain(others).chain(burst).collect();
        let (traffic, watch) = (&mut self.traffic, &mut self.watch);
        let mut frames = Vec::new();
        let next = self.bus.step(&mut participants, self.now, &mut |event| match event {
            Event::Frame { end, frame, transmitter, .. } => {
                traffic.frames += 1;
                frames.push((Instant(end.as_micros()), frame, transmitter));
            }
            Event::Error { .. } => traffic.errors += 1,
        });
        self.heard.extend(std::iter::from_fn(|| self.master.receive()));
        for (at, frame, transmitter) in frames {
            let sender = if transmitter < count { Sender::Node(transmitter) } else { Sender::Other };
            if let Some(frame) = from_bus(&frame) {
                watch.frame(at, &frame, sender);
                // Only SDO and boot-up messages can lead to a question.
                if matches!(frame.id(), 0x580..=0x67F | 0x700..=0x77F) {
                    let now = Instant(self.now.as_micros());
                    self.stations.iter_mut().for_each(|station| station.probe(now, watch));
                }
            }
        }
        next
    }

    /// The SDO channel to a server.
    pub fn server(&mut self, node_id: u8) -> Link<'_, U> {
        Link { network: self, node_id: node_id.into() }
    }
}

/// The SDO channel from the master to one server.
#[derive(Debug)]
pub struct Link<'a, U> {
    network: &'a mut Network<U>,
    node_id: u16,
}

impl<U: Unit> Channel for Link<'_, U> {
    fn send(&mut self, request: [u8; 8]) {
        self.network.transmit(&Frame::new(0x600 + self.node_id, &request).expect("a frame"));
    }

    fn received(&mut self) -> Option<[u8; 8]> {
        self.network.hear_id(0x580 + self.node_id)?.data().try_into().ok()
    }

    fn wait(&mut self) -> Option<[u8; 8]> {
        self.network.await_id(0x580 + self.node_id, TIME_OUT)?.data().try_into().ok()
    }
}
