//! The node of this project on the simulated bus.

use canopen::{Frame, Instant, NodeId, Transmit};
use node::{Personality, Protocol, Request, Setup};
use nodectl::bus::Station;

/// A pressure transmitter; it starts at the first poll and restarts when it is told to.
#[derive(Debug)]
pub(crate) struct Pressure {
    setup: Setup,
    protocol: Protocol,
    is_started: bool,
}

impl Pressure {
    pub(crate) fn new(id: u8) -> Pressure {
        let setup = Setup {
            personality: Personality::Pressure,
            node_id: NodeId::new(id).expect("a node-ID"),
            bit_rate: 250,
            serial_number: 0x1234_5678,
            hardware_version: "in process",
            software_version: "1.2.3",
        };
        Pressure { setup, protocol: Protocol::new(&setup), is_started: false }
    }

    fn serve_requests(&mut self) {
        while let Some(request) = self.protocol.take_request() {
            match request {
                Request::ResetNode => *self = Pressure::new(self.setup.node_id.get()),
                Request::ResetCommunication => self.is_started = false,
                Request::Filters | Request::BitRate(_) => (),
            }
        }
    }
}

impl Station for Pressure {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        if self.protocol.process_ids().any(|id| id == frame.id()) {
            self.protocol.on_process_frame(frame, now, out);
        }
        if self.protocol.service_ids().any(|id| id == frame.id()) {
            self.protocol.on_service_frame(frame, now, out);
        }
        self.serve_requests();
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if !std::mem::replace(&mut self.is_started, true) {
            self.protocol.start(now, out);
            self.serve_requests();
        }
        let process = self.protocol.poll_process(now, out);
        process.min(self.protocol.poll_services(now, out))
    }
}
