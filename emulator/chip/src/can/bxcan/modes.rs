//! Operating modes: initialisation, normal, sleep, and the recovery from bus-off (RM0390, bxCAN operating modes).

use canbus::{Monitor, Time};

use super::status::Status;
use super::transmit::Transmitter;
use super::{ABOM, AWUM, BxCan, INRQ, MCR_RESET, MCR_WRITABLE, RESET, SLEEP};
use crate::register::{bit, flag};

/// The mode that CAN_MSR acknowledges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Sleep,
    Initialisation,
    Normal,
}

impl BxCan {
    /// Whether the controller takes part in the traffic of the bus.
    pub(in crate::can) fn is_on_bus(&self) -> bool {
        self.mode == Mode::Normal && !self.loops_back() && self.clock > 0 && !self.status.is_bus_off()
    }

    /// The instant since which the controller is on the bus, or at which it will join the bus if no frame begins.
    pub(in crate::can) fn joins_at(&self) -> Option<Time> {
        let on_way = self.monitor.is_waiting() && !self.loops_back() && self.clock > 0;
        // In bus-off, the wait that ends initialisation is followed by the wait for the recovery.
        let last = self.mode == Mode::Normal || !self.status.is_bus_off();
        (self.is_on_bus() || on_way && last).then(|| self.monitor.ready(self.bit()))
    }

    /// INAK, SLAK, TXM, RXM and the recessive input.
    pub(super) fn mode_status(&self) -> u32 {
        let transmitting = self.transmitter.is_transmitting();
        let receiving = self.is_on_bus() && self.monitor.is_busy() && !transmitting;
        flag(self.mode == Mode::Initialisation, 0)
            | flag(self.mode == Mode::Sleep, 1)
            | flag(transmitting, 8)
            | flag(receiving, 9)
            | 0b11 << 10
    }

    /// Writes CAN_MCR.
    pub(super) fn write_control(&mut self, value: u32, now: Time) {
        self.poke = true;
        if bit(value, RESET) {
            return self.master_reset();
        }
        self.control = value & MCR_WRITABLE;
        self.follow_requests(now);
    }

    /// MCR.RESET: sleep mode with empty mailboxes. Bit timing, interrupt enables and filters stay.
    fn master_reset(&mut self) {
        let enable = self.status.enable;
        self.status = Status::default();
        self.status.write_enable(enable);
        self.control = MCR_RESET;
        self.mode = Mode::Sleep;
        self.monitor.cancel();
        self.looped = None;
        self.transmitter = Transmitter::default();
        self.fifos = Default::default();
    }

    /// Moves towards the mode that INRQ and SLEEP request (RM0390, bxCAN operating modes).
    pub(super) fn follow_requests(&mut self, now: Time) {
        match (self.is_set(INRQ), self.is_set(SLEEP)) {
            // To leave sleep mode for initialisation, software has to clear SLEEP as well.
            (true, true) if self.mode == Mode::Sleep => {}
            (true, _) => self.stop(Mode::Initialisation),
            (false, true) => self.stop(Mode::Sleep),
            (false, false) if self.mode == Mode::Normal => self.recover(now),
            // The feedback is internal: nothing on the bus delays it.
            (false, false) if self.loops_back() => {
                self.monitor.cancel();
                self.synchronised(now);
            }
            (false, false) if !self.monitor.is_waiting() => self.monitor.wait(1, now),
            (false, false) => {}
        }
    }

    /// Leaves the bus, as soon as the frame on the wire has ended.
    fn stop(&mut self, mode: Mode) {
        let in_frame = self.is_on_bus() && self.monitor.is_busy() || self.looped.is_some();
        if self.is_held || in_frame || self.mode == mode && !self.monitor.is_waiting() {
            return;
        }
        self.monitor.cancel();
        if self.mode == Mode::Sleep {
            self.status.awake();
        }
        if mode == Mode::Sleep && self.mode != Mode::Sleep {
            self.status.asleep();
        }
        self.mode = mode;
    }

    /// Begins the recovery from bus-off without software, if ABOM is set.
    pub(in crate::can) fn recover(&mut self, now: Time) {
        if self.status.is_bus_off() && self.is_set(ABOM) && !self.monitor.is_waiting() {
            self.monitor.wait(Monitor::BUS_OFF_SEQUENCES, now);
        }
    }

    /// The wait for recessive bits is over: the controller joins the bus or leaves bus-off.
    pub(super) fn synchronised(&mut self, now: Time) {
        if self.mode == Mode::Normal {
            return self.status.recovered();
        }
        self.mode = Mode::Normal;
        self.status.awake();
        // Software has set and cleared INRQ, which also begins the recovery.
        if self.status.is_bus_off() {
            self.monitor.wait(Monitor::BUS_OFF_SEQUENCES, now);
            // The earliest start of a waiting frame is known only now.
            self.poke = true;
        }
        self.begin_loop(now);
    }

    /// A start of frame.
    pub(in crate::can) fn hear_start(&mut self, transmitting: bool, at: Time) {
        self.advance(at);
        self.monitor.busy(at, self.bit());
        if transmitting {
            self.transmitter.begin(self.by_request_order(), at);
        }
        if self.mode == Mode::Sleep && self.is_set(SLEEP) {
            self.wake(at);
        }
    }

    fn wake(&mut self, at: Time) {
        self.status.woken();
        if self.is_set(AWUM) {
            self.control &= !(1 << SLEEP);
            self.follow_requests(at);
        }
    }

    /// The wire is recessive until the next frame: the controller can now follow a request to leave the bus.
    pub(in crate::can) fn hear_idle(&mut self, since: Time) {
        self.monitor.idle(since);
        if self.is_set(INRQ) || self.is_set(SLEEP) {
            self.follow_requests(since);
        }
    }
}
