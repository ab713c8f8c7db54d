//! The bootloader on the bus: the CANopen device, the update, and what one asks of the other.

use core::iter::{empty, once};

use bsp::back_off::BackOff;
use bsp::bit_rate_detection::{Heard, Step};
use bsp::bit_timing::BitTiming;
use bsp::bus_state::BusState;
use bsp::can::Controller;
use bsp::filters::{self, Banks};
use bsp::handover::Handover;
use bsp::{Clock, Received, retained};
use canopen::{Action, CanId, Duration, Instant, NodeId, ServiceDevice};
use update::{Authorisation, Crashes, Decision, Next, Phase, Proof, Start, Updater};

use crate::dictionary::{DICTIONARY, ROWS};
use crate::identity::Identity;
use crate::outbox::Outbox;
use crate::program::Program;
use crate::start::Reason;
use crate::target::TARGET;

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
    /// A copy that an earlier start has begun is being finished: after the copy the application starts, if there is one.
    is_resuming: bool,
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
        identity: Identity,
        authorisation: Authorisation,
        flash: bsp::ProgramFlash,
        can: Controller,
    ) -> Session {
        let status = if let Reason::Stay(status) = reason { status } else { update::Status::GOOD };
        let mut updater = Updater::new(flash, TARGET, status);
        // A refusal shows in the status.
        let _ = match reason {
            Reason::Stay(_) => Ok(()),
            Reason::Copy => updater.install(),
            Reason::Revert => updater.revert(),
        };
        Session {
            device: ServiceDevice::new(&DICTIONARY, identity.node_id, Program::new(updater, authorisation)),
            can,
            timing: identity.timing.unwrap_or(BitTiming::FASTEST),
            back_off: BackOff::default(),
            is_resuming: !matches!(reason, Reason::Stay(_)),
            reset: None,
        }
    }

    /// Goes on the bus at a rate, or listens at one. What was to be sent before is not sent any more.
    pub(crate) fn go(&mut self, step: Step, out: &mut Outbox) {
        out.clear();
        match step {
            Step::Found(timing) => {
                self.timing = timing;
                self.join(out);
            }
            Step::Listen(timing) => self.can.listen(timing),
            Step::Stay => (),
        }
        self.can.watch_errors();
    }

    /// Frames and errors that the controller has heard since the last call.
    pub(crate) fn heard(&mut self) -> Heard {
        self.can.heard()
    }

    /// Starts the communication. The controller joins last: what it acknowledges is answered.
    fn join(&mut self, out: &mut Outbox) {
        // What follows is left to the next poll.
        let _ = self.device.start(Clock::now(), out);
        self.can.start(self.timing, &self.banks());
        self.note();
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
        let next = self.advance(now);
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
    fn advance(&mut self, now: Instant) -> Next {
        let program = self.device.application_mut();
        let mut next = program.updater().poll();
        if program.updater().phase() == Phase::Committed {
            // A refusal shows in the status.
            let _ = program.updater().install();
            next = program.updater().next();
        }
        self.publish();
        if self.is_resuming && next == Next::Nothing {
            self.is_resuming = false;
            self.start_if_good(now);
        }
        next
    }

    /// The copy of an earlier start is finished or was refused: the application starts in either case, if the application is good.
    fn start_if_good(&mut self, now: Instant) {
        let updater = self.device.application_mut().updater();
        if updater.phase() == Phase::Installed {
            // What was counted were the crashes of another image.
            retained::set_crashes(Crashes::default());
        }
        let start = Start { crashes: retained::crashes(), proof: Proof::Waived, ..Start::default() };
        let flash = updater.flash();
        if matches!(update::boot(flash, &TARGET, start), Decision::Start(_)) {
            self.reset = Some(now);
        }
    }

    fn publish(&mut self) {
        self.device.show(|program, image| program.show(image));
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
            retained::set_crashes(Crashes::default());
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

    fn filter(&mut self) {
        self.can.set_filters(&self.banks());
    }

    /// NMT, SDO and LSS, all of them to FIFO 1: there is nothing else, and a client waits for its answers.
    fn banks(&self) -> Banks {
        let ids = once(CanId::NMT).chain(self.device.service_ids());
        filters::pack(empty(), ids.map(CanId::get))
    }
}
