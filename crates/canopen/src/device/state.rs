//! NMT state and resets, and the actions that wait for the caller.

use super::Definition;
use super::inner::Inner;
use super::pdos::low_half;
use super::{Action, Application, Device, Next, STALE};
use crate::dictionary::{Entry, Group};
use crate::nmt::{Command, State};
use crate::pdo::ProcessContext;
use crate::{Instant, NodeId, Transmit};

/// 1F80h: the only supported value that makes the node start by itself.
pub(super) const SELF_START: u32 = 0x08;

/// The part of the device that [`Device::start`] initialises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reset {
    /// Reset communication: the communication objects.
    Communication,
    /// Reset node, and the first start: all objects.
    Node,
}

/// The entries whose default values are loaded.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scope {
    Everything,
    /// The objects below 2000h but those that are stored with other groups, and others that are stored with them.
    Communication,
    Group(Group),
}

impl Scope {
    fn contains(self, entry: &Entry) -> bool {
        let group = entry.attributes.group;
        match self {
            Scope::Everything => true,
            Scope::Communication => match group {
                Some(group) => group == Group::Communication,
                None => entry.index() < 0x2000,
            },
            Scope::Group(own) => group == Some(own),
        }
    }
}

/// Actions that wait for the caller.
#[derive(Debug)]
#[allow(clippy::struct_excessive_bools)] // Independent flags.
pub(super) struct Pending {
    /// An action waits to be handed over.
    pub(super) is_waiting: bool,
    /// The scope of the next start. The caller is informed once (`reset_is_new`).
    reset: Reset,
    reset_is_new: bool,
    identifiers: bool,
    pub(super) parameters: bool,
    /// The NMT state to enter later: Operational with the first measured values, if 1F80h asks for it; Stopped when the
    /// EMCYs of an error are sent, if 1029h asks for it. A command of the master cancels both.
    pub(super) next_state: Option<State>,
    /// A request of LSS or of program control.
    request: Option<Action>,
}

impl Pending {
    pub(super) const fn new() -> Pending {
        Pending {
            is_waiting: false,
            reset: Reset::Node,
            reset_is_new: false,
            identifiers: false,
            parameters: false,
            next_state: None,
            request: None,
        }
    }

    /// The values have been loaded, so all identifiers and parameters may have changed.
    fn values_loaded(&mut self) {
        (self.identifiers, self.parameters, self.is_waiting) = (true, true, true);
    }

    /// The device starts. What a master or a client has asked for still waits for the caller.
    fn started(&mut self) {
        (self.reset, self.reset_is_new, self.next_state) = (Reset::Node, false, None);
    }

    pub(super) fn has_action(&self) -> bool {
        self.reset_is_new || self.identifiers || self.request.is_some()
    }

    fn reset(&mut self, reset: Reset) {
        (self.reset, self.reset_is_new, self.is_waiting) = (reset, true, true);
    }

    /// Asks the caller for an action.
    pub(super) fn ask(&mut self, action: Action) {
        (self.request, self.is_waiting) = (Some(action), true);
    }

    /// A job waits to be handed over.
    pub(super) fn job_waits(&mut self) {
        self.is_waiting = true;
    }

    pub(super) fn identifiers_changed(&mut self) {
        (self.identifiers, self.is_waiting) = (true, true);
    }

    pub(super) fn parameters_changed(&mut self) {
        self.parameters = true;
    }

    /// The next action for the caller, other than a job.
    pub(super) fn take_action(&mut self) -> Option<Action> {
        if core::mem::take(&mut self.reset_is_new) {
            return Some(match self.reset {
                Reset::Node => Action::ResetNode,
                Reset::Communication => Action::ResetCommunication,
            });
        }
        if let Some(request) = self.request.take() {
            return Some(request);
        }
        core::mem::take(&mut self.identifiers).then_some(Action::Identifiers)
    }
}

impl<D: Definition> Device<D> {
    /// Initialises the scope of the last reset (the first time, everything) and boots up. If 1F80h asks for it, a
    /// [`Device`](super::Device) starts by itself with the next [`publish`](super::Device::publish). A node-ID that LSS has configured is
    /// used from now on. Without a node-ID, the device waits for LSS.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        self.services.restart(&mut self.inner);
        self.inner.enter(State::Initialising);
        self.load();
        let inner = &mut self.inner;
        inner.pending.started();
        let node_id = inner.node_id;
        if node_id.is_some() {
            inner.configure(now);
            inner.heartbeat.boot_up(low_half(inner.number(0x1017, 0)), now);
        }
        inner.services_due = STALE;
        self.send_due_services(now, out);
        self.next()
    }

    /// Loads the values with which [`start`](Device::start) will begin, for parameters that are needed before the bus
    /// runs.
    // Not inlined: two callers, and much code.
    #[inline(never)]
    pub fn load(&mut self) {
        let inner = &mut self.inner;
        if inner.is_initialising() {
            inner.node_id = self.services.lss.node_id();
        }
        let reset = inner.pending.reset;
        inner.load_values(reset == Reset::Node);
        inner.application.initialise(reset, inner.image.as_mut());
        inner.pending.values_loaded();
    }

    /// Carries out an NMT command of the application itself, as one of the master. A device that has not started ignores
    /// it.
    pub fn nmt(&mut self, command: Command, now: Instant, out: &mut impl Transmit) -> Next {
        if self.inner.node_id.is_some() && !self.inner.is_initialising() {
            self.command(command);
        }
        self.poll(now, out)
    }

    /// Sets the node-ID with which the next [`start`](Device::start) begins; `None` to wait for one from LSS.
    pub fn set_node_id(&mut self, node_id: Option<NodeId>) {
        self.services.set_node_id(node_id);
    }

    pub(super) fn command(&mut self, command: Command) {
        let pending = &mut self.inner.pending;
        pending.next_state = None;
        let state = match command {
            Command::Start => State::Operational,
            Command::Stop => State::Stopped,
            Command::EnterPreOperational => State::PreOperational,
            Command::ResetNode => {
                pending.reset(Reset::Node);
                State::Initialising
            }
            Command::ResetCommunication => {
                pending.reset(Reset::Communication);
                State::Initialising
            }
        };
        self.inner.enter(state);
        self.silence_services();
    }
}

impl<D: Definition> Inner<D> {
    /// A device without a node-ID has received one. The caller has to start the device again.
    pub(super) fn request_boot_up(&mut self) {
        self.pending.reset(Reset::Communication);
    }

    pub(super) fn load_defaults(&mut self, scope: Scope) {
        for entry in self.dictionary.entries() {
            if !scope.contains(&entry) {
                continue;
            }
            if entry.attributes.node_relative {
                let number = self.default_number(&entry).to_le_bytes();
                entry.field.set(self.image.as_mut(), &number);
            } else if entry.rule().has_place() {
                entry.field.set(self.image.as_mut(), self.dictionary.default(&entry));
            }
        }
    }
}

impl<D: Definition> Inner<D> {
    /// Starts the device with its first values, if 1F80h asks for it. A device with an error does not start. Neither
    /// does a device that has already received an NMT command: the command has cleared the request.
    pub(super) fn self_start(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if !self.state.has_services() {
            return;
        }
        let next_state = &mut self.pending.next_state;
        if next_state.take_if(|state| *state == State::Operational).is_some() && self.emcy.register() == 0 {
            self.enter(State::Operational);
            self.send_process(context);
        }
    }
}
