//! A node as a station of a network: both halves, the parameter store, and the sensors.

use canopen::{Action, Duration, Frame, Instant, NodeId, Transmit};
use monitor::Sheet;
use node::{BitRate, Measurement, Personality, Protocol, Setup};
use profiles::board::{DIGITAL_INPUTS, Inputs, RawEncoder, RawSample};

use crate::asked::Asked;
use crate::bench::{Flash, empty_store, intact, run_job, setup};
use crate::network::Unit;
use crate::watch::sheet;

const SAMPLE_PERIOD: Duration = Duration::from_millis(1);

/// The sensors of a station.
pub trait Sensors {
    /// The current readings.
    fn read(&mut self, now: Instant) -> Inputs;
}

/// A constant pressure.
impl Sensors for RawSample {
    fn read(&mut self, _: Instant) -> Inputs {
        let position = RawEncoder::default();
        Inputs { analogue: *self, position, digital: [false; DIGITAL_INPUTS] }
    }
}

/// A node with its sensors.
#[derive(Debug)]
pub struct Station<S> {
    /// The CANopen half.
    pub protocol: Protocol,
    /// The sampling half.
    pub measurement: Measurement,
    /// The parameter store.
    pub store: Flash,
    personality: Personality,
    sensors: S,
    next_sample: Instant,
    asked: Asked,
}

/// A pressure node with constant readings.
pub type PressureNode = Station<RawSample>;

impl PressureNode {
    /// A pressure node with this serial number. Without a node-ID it waits for LSS.
    #[must_use]
    pub fn pressure(node_id: Option<NodeId>, serial_number: u32, raw: RawSample) -> PressureNode {
        Station::new(&Setup { node_id, bit_rate: BitRate::FASTEST, serial_number, ..setup() }, raw)
    }
}

impl<S: Sensors> Station<S> {
    /// A node without stored parameters.
    #[must_use]
    pub fn new(setup: &Setup, sensors: S) -> Station<S> {
        Station {
            protocol: Protocol::new(setup),
            measurement: Measurement::new(setup.personality, &intact()),
            store: empty_store(),
            personality: setup.personality,
            sensors,
            next_sample: Instant::NEVER,
            asked: Asked::default(),
        }
    }

    /// The sampling task: takes new parameters, samples and publishes.
    fn sample(&mut self, now: Instant, out: &mut impl Transmit) {
        self.next_sample = now + SAMPLE_PERIOD;
        if self.asked.take_parameters() {
            self.measurement.apply(&self.protocol.parameters());
        }
        let inputs = self.sensors.read(now);
        self.measurement.update(&inputs, self.protocol.snapshot_mut());
        self.asked.keep(self.protocol.publish(now, out));
    }
}

impl<S: Sensors> Unit for Station<S> {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.protocol.start(now, out));
        self.next_sample = now;
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.protocol.on_process_frame(frame, now, out));
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.asked.keep(self.protocol.on_service_frame(frame, now, out));
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next_sample {
            self.sample(now, out);
        }
        let process = self.protocol.poll_process(now, out).process;
        let next = self.protocol.poll_services(now, out);
        self.asked.keep(next);
        process.min(next.services).min(self.next_sample)
    }

    fn take_action(&mut self) -> Option<Action> {
        self.asked.take_action()
    }

    fn store(&mut self, now: Instant, out: &mut impl Transmit) {
        run_job(&mut self.protocol, &mut self.store, now, out);
    }

    fn sheet(&self) -> Option<Sheet> {
        Some(sheet(self.personality))
    }

    fn process_ids(&self) -> Vec<u16> {
        self.protocol.process_ids().collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.protocol.service_ids().collect()
    }
}
