//! The protocol half: the CANopen device with everything it owns.

use crate::{BusEvent, Parameters, Request, Setup, Snapshot};
use canopen::{Frame, Instant, Transmit};

/// The CANopen device of one node. The process-data task and the services task share it; each locks it for one call.
#[derive(Debug)]
pub struct Protocol {
    setup: Setup,
}

impl Protocol {
    /// A node that has not started: it is silent and hears nothing until `start`.
    #[must_use]
    pub fn new(setup: &Setup) -> Protocol {
        Protocol { setup: *setup }
    }

    /// Initialises what the pending reset covers, then boots up. To be called once the bus is ready,
    /// and again for `Request::ResetCommunication`.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        let _ = now;
        let bootup = Frame::new(0x700 | u16::from(self.setup.node_id.get()), &[0]);
        let _ = bootup.map(|frame| out.send(frame));
    }

    /// A frame of FIFO 0: NMT, SYNC, RPDO, or a remote request for a TPDO.
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let _ = (frame, now, out.room());
    }

    /// A frame of FIFO 1: everything else.
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let _ = (frame, now, out.room());
    }

    /// Takes the values of the last millisecond into the dictionary and sends what their change triggers.
    pub fn publish(&mut self, snapshot: &Snapshot, now: Instant, out: &mut impl Transmit) {
        let _ = (snapshot, now, out.room());
    }

    /// Does what is due of PDO and SYNC timers. Returns the instant at which it wants to be called again.
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let _ = (now, out.room());
        Instant::NEVER
    }

    /// Does what is due of heartbeat, SDO and EMCY. Returns the instant at which it wants to be called again.
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let _ = (now, out.room());
        Instant::NEVER
    }

    /// The next thing that the firmware must do. To be asked after every call above until it is `None`.
    pub fn take_request(&mut self) -> Option<Request> {
        None
    }

    /// The parameters for `Measurement::apply`, when they have changed since the last call (and after `start`).
    pub fn take_parameters(&mut self) -> Option<Parameters> {
        None
    }

    /// Identifiers for FIFO 0, data and remote frames.
    pub fn process_ids(&self) -> impl Iterator<Item = u16> {
        core::iter::once(0)
    }

    /// Identifiers for FIFO 1.
    pub fn service_ids(&self) -> impl Iterator<Item = u16> {
        core::iter::once(0x600 | u16::from(self.setup.node_id.get()))
    }

    /// Takes note of an event on the bus.
    pub fn bus_event(&mut self, event: BusEvent, now: Instant, out: &mut impl Transmit) {
        let _ = (event, now, out.room());
    }
}
