//! The bootloader on the bus: the CANopen device, the update, and what one asks of the other.

use core::iter::{empty, once};

use bsp::back_off::BackOff;
use bsp::bit_timing::BitTiming;
use bsp::bus_state::BusState;
use bsp::can::Controller;
use bsp::filters;
use bsp::handover::Handover;
use bsp::{Clock, Received, retained};
use canopen::{Action, CanId, Duration, Instant, NodeId, ServiceDevice};
use update::{Next, Phase, Updater};

use crate::dictionary::{DICTIONARY, ROWS};
use crate::outbox::Outbox;
use crate::program::Program;
use crate::start::Reason;
use crate::target::TARGET;

/// Where a node without an application is found, whatever it was before.
const NODE_ID: Option<NodeId> = NodeId::new(126);
const KBIT: u16 = 250;

/// The loop comes by at least this often: a recovery of the bus raises no interrupt.
const PERIOD: Duration = Duration::from_millis(20);
/// While a sector erases by itself.
const ERASE_POLL: Duration = Duration::from_millis(1);
/// How long a reset waits for what is still to be sent, on a bus where nobody acknowledges.
const FAREWELL: Duration = Duration::from_millis(20);

/// Everything but the queues.
pub(crate) struct Session {
    device: canopen::service_device!(Program, ROWS),
    can: Controller,
    timing: BitTiming,
    back_off: BackOff,
    /// A copy that was begun before anybody could know where the bus is goes on without it.
    is_silent: bool,
    /// The chip is to be reset, at the latest then.
    reset: Option<Instant>,
}

/// What the loop does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// Comes by again at once.
    Again,
    /// Sleeps until then.
    Sleep(Instant),
    /// Resets the chip when the queue is empty, and at the latest then.
    Reset(Instant),
}

impl Session {
    pub(crate) fn new(
        reason: Reason,
        note: Option<Handover>,
        flash: bsp::ProgramFlash,
        can: Controller,
    ) -> Session {
        let status = if let Reason::Stay(status) = reason { status } else { update::Status::GOOD };
        let mut updater = Updater::new(flash, TARGET, status);
        if reason == Reason::Copy {
            // A refusal shows in the status.
            let _ = updater.install();
        }
        let node_id = note.map_or(NODE_ID, |note| note.node_id.and_then(NodeId::new));
        let timing =
            note.map(|note| note.timing).or_else(|| BitTiming::of(KBIT)).unwrap_or(BitTiming::FASTEST);
        Session {
            device: ServiceDevice::new(&DICTIONARY, node_id, Program::new(updater, TARGET)),
            can,
            timing,
            back_off: BackOff::default(),
            is_silent: reason == Reason::Copy && note.is_none(),
            reset: None,
        }
    }

    /// Goes on the bus.
    pub(crate) fn join(&mut self, out: &mut Outbox) {
        if self.is_silent {
            return;
        }
        self.can.start(self.timing, &[]);
        // What follows is left to the next poll.
        let _ = self.device.start(Clock::now(), out);
        self.note();
        self.filter();
    }

    /// A frame has come: each of the two takes what is its own.
    pub(crate) fn take(&mut self, received: &Received, out: &mut Outbox) {
        let Received { frame, at } = received;
        let next = self.device.on_frame(frame, *at, out);
        self.publish();
        self.fulfil(next, out);
    }

    /// One step of everything.
    pub(crate) fn step(&mut self, out: &mut Outbox) -> Then {
        let now = Clock::now();
        self.watch_bus(now);
        let next = self.advance(now, out);
        let next_call = self.device.poll(now, out);
        let due = self.fulfil(next_call, out);
        match (self.reset, next) {
            (Some(latest), _) => Then::Reset(latest),
            (None, Next::Step) => Then::Again,
            (None, Next::Erasing) => Then::Sleep(due.min(now + ERASE_POLL)),
            (None, Next::Nothing) => Then::Sleep(due.min(now + PERIOD).min(self.back_off.due())),
        }
    }

    /// One step of the update. An image that is good is copied at once: 1F57h is busy until it can be started.
    fn advance(&mut self, now: Instant, out: &mut Outbox) -> Next {
        let program = self.device.application_mut();
        let mut next = program.updater().poll();
        if program.updater().phase() == Phase::Committed {
            // A refusal shows in the status.
            let _ = program.updater().install();
            next = program.updater().next();
        }
        self.publish();
        if self.is_silent && next == Next::Nothing {
            self.end_silence(now, out);
        }
        next
    }

    /// A silent copy has come to its end: the application is started, or the bus is told.
    fn end_silence(&mut self, now: Instant, out: &mut Outbox) {
        self.is_silent = false;
        if self.device.application_mut().updater().phase() == Phase::Installed {
            self.reset = Some(now);
        } else {
            self.join(out);
        }
    }

    fn publish(&mut self) {
        self.device.show(|program, image| program.readings().store(image));
    }

    /// Does what a call leaves to the bootloader, until nothing is left; when the next call is due.
    fn fulfil(&mut self, mut next: canopen::Next, out: &mut Outbox) -> Instant {
        while let Some(action) = next.action {
            match action {
                Action::ResetNode | Action::Bootloader => self.reset_soon(),
                Action::ResetCommunication => self.join(out),
                Action::Identifiers => self.filter(),
                Action::BitRate(bit_rate) => {
                    self.timing = BitTiming::of(bit_rate.kbit()).unwrap_or(self.timing);
                    self.can.start(self.timing, &[]);
                    self.note();
                    self.filter();
                }
                // The parameters are the application's.
                Action::Store(_) => (),
            }
            next = self.device.poll(Clock::now(), out);
        }
        if self.device.application().starts() {
            retained::set_trial(retained::trial().confirmed());
            self.reset_soon();
        }
        next.due()
    }

    fn reset_soon(&mut self) {
        self.reset.get_or_insert(Clock::now() + FAREWELL);
    }

    /// Where the node is on the bus, for the next start.
    fn note(&self) {
        let node_id = self.device.node_id().map(NodeId::get);
        retained::hand_over(&Handover { node_id, timing: self.timing, stay: false });
    }

    fn watch_bus(&mut self, now: Instant) {
        if self.can.state() == BusState::Off {
            self.back_off.bus_off(now);
        }
        if self.back_off.is_over(now) {
            self.can.recover();
        }
    }

    /// NMT, SDO and LSS, all of them to FIFO 1: there is nothing else, and a client waits for its answers.
    fn filter(&mut self) {
        let ids = once(CanId::NMT).chain(self.device.service_ids());
        let banks = filters::pack(empty(), ids.map(CanId::get));
        self.can.set_filters(&banks);
    }
}
