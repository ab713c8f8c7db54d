//! The pressure node as a station of a network: both halves, its parameter store, and readings that do not change.

use canopen::{Duration, Frame, Instant, NodeId, Transmit};
use node::{BitRate, Measurement, Protocol, RawEncoder, RawSample, Request, Setup, Start};

use crate::bench::{Flash, deliver, empty_store, setup};
use crate::network::Unit;

const SAMPLE_PERIOD: Duration = Duration::from_millis(1);

/// A pressure node.
#[derive(Debug)]
pub struct PressureNode {
    /// The CANopen half.
    pub protocol: Protocol,
    /// The sampling half.
    pub measurement: Measurement,
    /// What it stores.
    pub store: Flash,
    raw: RawSample,
    next_sample: Instant,
}

impl PressureNode {
    /// A node with this serial number and these readings. Without a node-ID it waits for LSS.
    #[must_use]
    pub fn new(node_id: Option<NodeId>, serial_number: u32, raw: RawSample) -> PressureNode {
        let setup = Setup { node_id, bit_rate: BitRate::FASTEST, serial_number, ..setup() };
        PressureNode {
            protocol: Protocol::new(&setup),
            measurement: Measurement::new(setup.personality, Start::First),
            store: empty_store(),
            raw,
            next_sample: Instant::NEVER,
        }
    }

    /// The sampling task: takes new parameters, samples and publishes.
    fn sample(&mut self, now: Instant, out: &mut impl Transmit) {
        self.next_sample = now + SAMPLE_PERIOD;
        if let Some(parameters) = self.protocol.take_parameters() {
            self.measurement.apply(&parameters);
        }
        let snapshot = self.measurement.sample(&self.raw, &RawEncoder::default(), [false; 2]);
        self.protocol.publish(&snapshot, now, out);
    }
}

impl Unit for PressureNode {
    fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.protocol.start(now, out);
        self.next_sample = now;
    }

    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.protocol.on_process_frame(frame, now, out);
    }

    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.protocol.on_service_frame(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next_sample {
            self.sample(now, out);
        }
        let process = self.protocol.poll_process(now, out);
        process.min(self.protocol.poll_services(now, out)).min(self.next_sample)
    }

    fn take_request(&mut self) -> Option<Request> {
        self.protocol.take_request()
    }

    fn store(&mut self, now: Instant, out: &mut impl Transmit) {
        deliver(&mut self.protocol, &mut self.store, now, out);
    }

    fn process_ids(&self) -> Vec<u16> {
        self.protocol.process_ids().collect()
    }

    fn service_ids(&self) -> Vec<u16> {
        self.protocol.service_ids().collect()
    }
}
