//! A station: does the work of the firmware's tasks around a node, in one function.

use canopen::{Action, Frame, Instant, Transmit};

use monitor::{Incident, Sheet};

use super::port::Port;
use crate::watch::Watch;

/// The device in a station: a node, or a device of a test.
pub trait Unit {
    /// Boots, or boots again after a reset.
    fn start(&mut self, now: Instant, out: &mut impl Transmit);
    /// A frame of FIFO 0.
    fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit);
    /// A frame of FIFO 1.
    fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit);
    /// Does the work that is due and returns the instant of the next call.
    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant;
    /// The next action that only the firmware can carry out.
    fn take_action(&mut self) -> Option<Action>;
    /// Carries out a requested store job.
    fn store(&mut self, _now: Instant, _out: &mut impl Transmit) {}
    /// The data sheet of a new unit, for the monitor.
    fn sheet(&self) -> Option<Sheet> {
        None
    }
    /// Identifiers for FIFO 0.
    fn process_ids(&self) -> Vec<u16>;
    /// Identifiers for FIFO 1.
    fn service_ids(&self) -> Vec<u16>;
}

/// A unit, its port and its acceptance filters.
#[derive(Debug)]
pub struct Station<U> {
    /// The device.
    pub unit: U,
    /// The connection to the bus.
    pub port: Port,
    /// Position on the bus.
    number: usize,
    filters: [Vec<u16>; 2],
    due: Instant,
}

impl<U: Unit> Station<U> {
    /// A station that neither sends nor receives until it is started.
    pub(super) fn new(unit: U, port: Port, number: usize) -> Station<U> {
        Station { unit, port, number, filters: [vec![], vec![]], due: Instant::NEVER }
    }

    /// Power-on.
    pub(super) fn start(&mut self, now: Instant, watch: &mut Watch) {
        if let Some(sheet) = self.unit.sheet() {
            watch.monitor().set_sheet(self.number, sheet, true);
        }
        watch.incident(now, self.number, Incident::PowerOn);
        self.unit.start(now, &mut self.port);
        self.poll(now, watch);
    }

    /// The instant at which the station must run if no frame arrives earlier.
    pub(super) fn due(&self) -> Instant {
        if self.port.has_mail() { Instant(0) } else { self.due }
    }

    /// Processes the received frames and the work that is due.
    pub(super) fn run(&mut self, now: Instant, watch: &mut Watch) {
        while let Some(frame) = self.port.receive() {
            self.filter(&frame, now, watch);
        }
        if now >= self.due {
            self.poll(now, watch);
        }
    }

    /// Lets the monitor read values beside the bus.
    pub(super) fn probe(&mut self, now: Instant, watch: &mut Watch) {
        let unit = &mut self.unit;
        watch.probe(now, self.number, |request, answers| unit.on_service_frame(request, now, answers));
    }

    fn filter(&mut self, frame: &Frame, now: Instant, watch: &mut Watch) {
        let [process, services] = [0, 1].map(|fifo: usize| self.filters[fifo].contains(&frame.id()));
        if process {
            self.unit.on_process_frame(frame, now, &mut self.port);
        }
        if services {
            let unit = &mut self.unit;
            watch.probe_before(now, self.number, frame, |request, answers| {
                unit.on_service_frame(request, now, answers);
            });
            self.unit.on_service_frame(frame, now, &mut self.port);
        }
        if process || services {
            self.poll(now, watch);
        }
    }

    fn poll(&mut self, now: Instant, watch: &mut Watch) {
        self.fulfil(now);
        let due = self.unit.poll(now, &mut self.port);
        watch.feed(|monitor| monitor.deadline(now, self.number, due));
        // The next call is at least a microsecond later: a deadline in the past must not stop the time.
        self.due = due.max(Instant(now.0 + 1));
        self.fulfil(now);
    }

    fn fulfil(&mut self, now: Instant) {
        while let Some(action) = self.unit.take_action() {
            match action {
                Action::ResetNode | Action::ResetCommunication => {
                    self.port.clear();
                    self.unit.start(now, &mut self.port);
                    self.due = now;
                }
                Action::Identifiers => self.filters = [self.unit.process_ids(), self.unit.service_ids()],
                Action::Store(_) => self.unit.store(now, &mut self.port),
                other => panic!("{other:?}: the network has one bit rate and no bootloader"),
            }
        }
    }
}
