//! The bootloader on the bus: the CANopen device, the update, and the actions between them.

use bsp::can::Controller;
use bsp::can::bit_timing::BitTiming;
use bsp::can::bus_state::{BusState, Heard};
use bsp::can::filters::{Bank, Fifo, Pair};
use bsp::chip::handover::Handover;
use bsp::chip::retained;
use bsp::policy::back_off::BackOff;
use bsp::policy::bit_rate_detection::Step;
use bsp::{Clock, Received};
use canopen::{Action, CanId, Duration, Instant, NodeId, ServiceDevice};
use update::{Authorisation, Crashes, Decision, Next, Phase, Proof, Start, Updater};

use crate::dictionary::{DICTIONARY, ROWS};
use crate::identity::Identity;
use crate::outbox::Outbox;
use crate::program::Program;
use crate::run::after;
use crate::start::Reason;
use crate::target::TARGET;

/// The loop runs at least this often, because a recovery of the bus raises no interrupt.
const PERIOD: Duration = Duration::from_millis(20);
/// Polling interval while a sector is being erased.
const ERASE_POLL: Duration = Duration::from_millis(1);
/// CAN-IDs (CiA 301, 7.3.5): a request to the SDO server of node 0, and a message of the LSS master.
const SDO_REQUEST: u16 = 0x600;
const LSS_REQUEST: u16 = 0x7E5;
/// Longest time for which a reset waits for unsent frames: at 10 kbit/s a frame of another node, and two of this one.
const FAREWELL: Duration = Duration::from_millis(50);

/// Everything except the queues.
pub(crate) struct Session {
    device: canopen::service_device!(Program, ROWS),
    can: Controller,
    timing: BitTiming,
    back_off: BackOff,
    /// A copy begun by an earlier start is being finished. Afterwards the application is started, if it is valid.
    is_resuming: bool,
    /// The chip must be reset, at this time at the latest.
    reset: Option<Instant>,
}

/// Next action of the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// Runs again at once.
    Again,
    /// Sleeps until this time.
    Sleep(Instant),
    /// Resets the chip when the queue is empty, at this time at the latest.
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
        let program = Program::new(updater, authorisation, &identity);
        Session {
            device: ServiceDevice::new(&DICTIONARY, identity.node_id, program),
            can,
            timing: identity.timing.unwrap_or(BitTiming::FASTEST),
            back_off: BackOff::default(),
            is_resuming: !matches!(reason, Reason::Stay(_)),
            reset: None,
        }
    }

    /// Joins the bus at a rate, or listens at one. Frames that were waiting are dropped.
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

    /// Frames and errors that the controller has seen since the last call.
    pub(crate) fn heard(&mut self) -> Heard {
        self.can.heard()
    }

    /// Starts the communication. The controller joins last, so that every acknowledged frame is also answered.
    fn join(&mut self, out: &mut Outbox) {
        // The resulting actions are left to the next poll.
        let _ = self.device.start(Clock::now(), out);
        self.enter();
    }

    /// The controller joins the bus. The next start finds the node-ID and the bit rate.
    #[inline(never)]
    fn enter(&mut self) {
        self.can.start(self.timing, &self.banks());
        let node_id = self.device.node_id().map(NodeId::get);
        retained::hand_over(&Handover { node_id, timing: self.timing, stay: false });
    }

    /// Handles a received frame.
    pub(crate) fn take(&mut self, received: &Received, out: &mut Outbox) {
        let Received { frame, at } = received;
        let next = self.device.on_frame(frame, *at, out);
        self.publish();
        self.fulfil(next, out);
    }

    /// Does one step of everything.
    pub(crate) fn step(&mut self, out: &mut Outbox) -> Then {
        let now = Clock::now();
        self.watch_bus(now);
        let next = self.advance();
        let next_call = self.device.poll(now, out);
        let due = self.fulfil(next_call, out);
        let pause = match (next, self.reset) {
            // A reset waits until the work on the flash is done: resets in the middle of copies would wear it out.
            (Next::Step, _) => return Then::Again,
            (Next::Erasing, _) => ERASE_POLL,
            (Next::Nothing, Some(latest)) => return Then::Reset(latest),
            (Next::Nothing, None) => PERIOD,
        };
        Then::Sleep(due.min(after(pause)).min(self.back_off.due()))
    }

    /// Does one step of the update. A valid image is copied at once: 1F57h is busy until the image can be started.
    fn advance(&mut self) -> Next {
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
            self.start_if_good();
        }
        next
    }

    /// The copy of an earlier start is finished or was refused: starts the application in either case, if it is valid.
    fn start_if_good(&mut self) {
        let updater = self.device.application_mut().updater();
        if updater.phase() == Phase::Installed {
            // The crash count belonged to another image.
            retained::set_crashes(Crashes::default());
        }
        let start = Start { crashes: retained::crashes(), proof: Proof::Waived, ..Start::default() };
        let flash = updater.flash();
        if matches!(update::boot(flash, &TARGET, start), Decision::Start(_)) {
            self.reset_soon();
        }
    }

    fn publish(&mut self) {
        self.device.show(|program, image| program.show(image));
    }

    /// Carries out the actions that a call leaves to the bootloader, until none is left. Returns the time of the next
    /// call.
    fn fulfil(&mut self, mut next: canopen::Next, out: &mut Outbox) -> Instant {
        while let Some(action) = next.action {
            match action {
                Action::ResetNode | Action::Bootloader => self.reset_soon(),
                Action::ResetCommunication => self.join(out),
                Action::Identifiers => self.filter(),
                Action::BitRate(bit_rate) => {
                    self.timing = BitTiming::of(bit_rate.kbit()).unwrap_or(self.timing);
                    self.enter();
                }
                // The parameters belong to the application.
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
        self.reset.get_or_insert(after(FAREWELL));
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

    /// Filters for NMT, LSS and SDO, all to FIFO 1: there are no other frames, and a client waits for its answers. Not those
    /// of [`ServiceDevice::service_ids`], whose iterator needs 800 bytes of flash.
    fn banks(&self) -> [Bank; 2] {
        let request = self.device.node_id().map_or(LSS_REQUEST, |own| SDO_REQUEST | u16::from(own.get()));
        [[Pair::exactly(CanId::NMT.get()), Pair::exactly(LSS_REQUEST)], [Pair::exactly(request); 2]]
            .map(|pairs| Bank { fifo: Fifo::Services, pairs })
    }
}
