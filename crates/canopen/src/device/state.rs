//! NMT state, resets, and the reactions to errors.

use super::pdos::low_half;
use super::{Action, Application, Core, Device, Next, STALE};
use crate::dictionary::{Entry, Group};
use crate::nmt::{Command, State};
use crate::transmit::Turn;
use crate::{CanId, Instant, NodeId, Transmit};

/// 1F80h: the one value that makes the node start by itself.
pub(super) const SELF_START: u32 = 0x08;

/// What [`Device::start`] has to initialise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reset {
    Communication,
    Node,
}

/// Whose default values are loaded.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scope {
    Everything,
    /// The objects below 2000h.
    Communication,
    Group(Group),
}

impl Scope {
    fn contains(self, entry: &Entry) -> bool {
        match self {
            Scope::Everything => true,
            Scope::Communication => entry.index() < 0x2000,
            Scope::Group(group) => entry.attributes.group == Some(group),
        }
    }
}

/// What waits for the caller.
#[derive(Debug)]
#[allow(clippy::struct_excessive_bools)] // Each waits for its own.
pub(super) struct Pending {
    /// An action waits to be handed over.
    is_waiting: bool,
    /// What the next start covers; told to the caller once.
    reset: Reset,
    reset_untold: bool,
    identifiers: bool,
    parameters: bool,
    /// The state to which the first values lead, where 1F80h asks for it: no PDO carries what nobody has measured.
    with_values: Option<State>,
    /// Of LSS or of program control.
    request: Option<Action>,
}

impl Pending {
    pub(super) const fn new() -> Pending {
        Pending {
            is_waiting: false,
            reset: Reset::Node,
            reset_untold: false,
            identifiers: false,
            parameters: false,
            with_values: None,
            request: None,
        }
    }

    fn has_action(&self) -> bool {
        self.reset_untold || self.identifiers || self.request.is_some()
    }

    /// Asks the caller for something.
    pub(super) fn ask(&mut self, action: Action) {
        (self.request, self.is_waiting) = (Some(action), true);
    }

    /// A job waits to be handed over.
    pub(super) fn has_job(&mut self) {
        self.is_waiting = true;
    }

    pub(super) fn identifiers_changed(&mut self) {
        (self.identifiers, self.is_waiting) = (true, true);
    }

    pub(super) fn parameters_changed(&mut self) {
        self.parameters = true;
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    /// Initialises what the last reset covers (at first everything) and boots up; if 1F80h says so, the device starts by
    /// itself with the next [`publish`](Device::publish). A node-ID that LSS has configured is taken now; without one, the
    /// device waits for LSS.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        self.forget_transfer();
        self.lss.reset();
        self.core.enter(State::Initialising);
        self.core.node_id = self.lss.pending().node_id;
        self.core.load();
        if self.core.node_id.is_some() {
            self.core.configure(now);
            self.core.enter(State::PreOperational);
            let starts = !A::SERVICES_ONLY && self.core.number(0x1F80, 0) == SELF_START;
            self.core.pending.with_values = starts.then_some(State::Operational);
        }
        self.poll_services(now, out)
    }

    /// There are values now. A device with an error, or one that its master has already told a state, does not start.
    pub(super) fn start_by_itself(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let Some(state) = self.core.pending.with_values.take() else { return };
        if self.core.emcy.register() == 0 {
            self.core.enter(state);
            self.send_process(turn);
        }
    }

    /// Takes the values that [`start`](Device::start) will begin with: for parameters that are needed before there is a bus.
    pub fn load(&mut self) {
        self.core.load();
    }

    /// What follows from a call of the process half.
    #[inline]
    pub(super) fn process_next(&self) -> Next {
        let Core { process_due, services_due, .. } = self.core;
        Next { process: process_due, services: services_due, action: None, parameters: false }
    }

    /// What follows from a call of the services half.
    #[inline]
    pub(super) fn services_next(&mut self) -> Next {
        let parameters = core::mem::take(&mut self.core.pending.parameters);
        let action = if self.core.pending.is_waiting { self.hand_over() } else { None };
        Next { action, parameters, ..self.process_next() }
    }

    #[inline(never)]
    fn hand_over(&mut self) -> Option<Action> {
        let action = self.take_action();
        let is_waiting = self.core.pending.has_action() || self.core.jobs.is_untold();
        self.core.pending.is_waiting = is_waiting;
        if is_waiting {
            self.core.services_due = STALE;
        }
        action
    }

    /// The next thing that is left to the caller.
    fn take_action(&mut self) -> Option<Action> {
        let pending = &mut self.core.pending;
        if core::mem::take(&mut pending.reset_untold) {
            return Some(match pending.reset {
                Reset::Node => Action::ResetNode,
                Reset::Communication => Action::ResetCommunication,
            });
        }
        if let Some(request) = pending.request.take() {
            return Some(request);
        }
        if core::mem::take(&mut pending.identifiers) {
            return Some(Action::Identifiers);
        }
        self.core.jobs.take_untold().map(Action::Store)
    }

    pub(super) fn command(&mut self, command: Command) {
        self.core.pending.with_values = None;
        match command {
            Command::Start => self.core.enter(State::Operational),
            Command::Stop => self.core.enter(State::Stopped),
            Command::EnterPreOperational => self.core.enter(State::PreOperational),
            Command::ResetNode => self.core.begin_reset(Reset::Node),
            Command::ResetCommunication => self.core.begin_reset(Reset::Communication),
        }
        self.silence_services();
    }

    /// A transfer does not survive a state without SDO.
    pub(super) fn silence_services(&mut self) {
        if !self.core.state.has_services() {
            self.forget_transfer();
        }
    }

    fn forget_transfer(&mut self) {
        self.server.reset();
        (self.reply_due, self.block_due) = (Instant::NEVER, Instant::NEVER);
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Core<A, N, T, R, W, M>
{
    /// A device that had no node-ID has got one. Whoever calls the device starts it again.
    pub(super) fn begin_join(&mut self) {
        self.begin_reset(Reset::Communication);
    }

    /// The identifier of one of its services; that of no device while it has no node-ID.
    pub(super) fn service(&self, function: u16) -> CanId {
        CanId::of_service(function, self.node_id.map_or(0, NodeId::get))
    }

    fn begin_reset(&mut self, reset: Reset) {
        self.enter(State::Initialising);
        (self.pending.reset, self.pending.reset_untold, self.pending.is_waiting) = (reset, true, true);
    }

    pub(super) fn enter(&mut self, state: State) {
        if state == self.state {
            return;
        }
        self.state = state;
        self.services_due = STALE;
        if !A::SERVICES_ONLY {
            self.enter_process(state);
        }
        self.application.state(state, &mut self.image);
    }

    fn enter_process(&mut self, state: State) {
        self.sync.stop();
        for place in 0..T {
            if let Some(tpdo) = self.tpdos.get_mut(place) {
                if state.has_pdos() { tpdo.start() } else { tpdo.stop() }
            }
            self.begin_events(place);
        }
        self.rpdos.iter_mut().for_each(crate::pdo::Rpdo::stop);
        if state.has_pdos() {
            self.scanner.start();
        } else {
            self.scanner.stop();
        }
        self.process_due = STALE;
    }

    /// Takes the values of what is to be reset: the defaults, then what is stored.
    // Called from two places, and much code.
    #[inline(never)]
    fn load(&mut self) {
        if A::SERVICES_ONLY {
            // Nothing of it is stored, and nothing depends on the node-ID.
            self.dictionary.load_defaults(&mut self.image);
        } else {
            self.load_parameters();
        }
        self.application.initialise(&mut self.image);
        self.pending = Pending { identifiers: true, parameters: true, is_waiting: true, ..Pending::new() };
    }

    fn load_parameters(&mut self) {
        let everything = self.pending.reset == Reset::Node;
        self.load_defaults(if everything { Scope::Everything } else { Scope::Communication });
        self.load_stored(Group::Communication);
        if everything {
            self.load_stored(Group::Application);
            self.load_stored(Group::Calibration);
        }
    }

    pub(super) fn load_defaults(&mut self, scope: Scope) {
        for entry in self.dictionary.entries().filter(|entry| scope.contains(entry)) {
            if entry.attributes.node_relative {
                let default = self.dictionary.default_number(&entry, self.node_id);
                entry.field.store(&mut self.image, default.to_le_bytes());
            } else if entry.rule().has_place() {
                entry.field.set(&mut self.image, self.dictionary.default(&entry));
            }
        }
    }

    /// Gives every protocol its parameters.
    fn configure(&mut self, now: Instant) {
        if !A::SERVICES_ONLY {
            self.configure_process(now);
        }
        self.heartbeat.boot_up(low_half(self.number(0x1017, 0)), now);
    }

    fn configure_process(&mut self, now: Instant) {
        self.configure_sync(now);
        self.emcy.configure(self.number_or(0x1014, 0, NO_EMCY));
        self.emcy.set_inhibit(low_half(self.number(0x1015, 0)));
        self.configure_watches(now);
        self.configure_pdos(now);
        self.emcy.restart(now);
        self.report_stored(now);
        self.update_error_register();
    }
}

/// What a dictionary without 1014h amounts to.
const NO_EMCY: u32 = 1 << 31;
