//! The NMT state of one node, as its heartbeats, its services and the commands of the master show it.

use canopen::Instant;
use canopen::nmt::State;

use crate::{Findings, Rule};

/// How long a frame that was queued before a command may follow it, in us.
const QUEUED: u64 = 500_000;
/// Heartbeats for which an EMCY explains a change of the state.
const EXPLAINED: u8 = 2;

/// A command of the master to this node.
#[derive(Clone, Copy, Debug)]
struct Command {
    at: Instant,
    leads_to: State,
}

/// An error after which the state is known.
#[derive(Clone, Copy, Debug)]
struct Demand {
    code: u16,
    /// The sub-index of 1029h for this class of errors.
    class: u8,
    heartbeats: u8,
}

/// The state.
#[derive(Debug, Default)]
pub(crate) struct Nmt {
    /// The state that the node has shown.
    shown: Option<State>,
    commands: Vec<Command>,
    /// The node may start itself after the boot-up.
    may_start: bool,
    /// Heartbeats for which an EMCY explains a change.
    explained: u8,
    demand: Option<Demand>,
}

impl Nmt {
    pub(crate) fn state(&self) -> Option<State> {
        self.shown
    }

    pub(crate) fn command(&mut self, command: u8, now: Instant) {
        let leads_to = match command {
            1 => State::Operational,
            2 => State::Stopped,
            128 => State::PreOperational,
            _ => return,
        };
        self.demand = None;
        self.commands.push(Command { at: now, leads_to });
    }

    /// A boot-up message. A command may have come before it.
    pub(crate) fn boot_up(&mut self, may_start: bool) {
        let commands = std::mem::take(&mut self.commands);
        *self = Nmt { shown: Some(State::PreOperational), may_start, commands, ..Nmt::default() };
    }

    /// The node restarts.
    pub(crate) fn restart(&mut self) {
        *self = Nmt::default();
    }

    /// An EMCY: explains a change. `class`: the sub-index of 1029h for this error, if known. A command that no heartbeat
    /// has shown yet may have come after the error.
    pub(crate) fn error(&mut self, code: u16, class: Option<u8>) {
        self.explained = EXPLAINED;
        if let Some(class) = class.filter(|_| self.commands.is_empty()) {
            self.demand = Some(Demand { code, class, heartbeats: 0 });
        }
    }

    /// The sub-index of 1029h whose value decides about the next heartbeat.
    pub(crate) fn demands(&self) -> Option<u8> {
        Some(self.demand?.class)
    }

    /// A heartbeat. `behaviour`: the value of 1029h for the last error. `has_emcy`: the node can send EMCY at once.
    pub(crate) fn heartbeat(
        &mut self,
        state: State,
        behaviour: Option<u32>,
        has_emcy: bool,
        now: Instant,
        findings: &mut Findings,
    ) {
        self.follow_demand(state, behaviour, findings);
        let before = self.shown.replace(state);
        let explained = self.explained > 0 || !has_emcy;
        self.explained = self.explained.saturating_sub(1);
        let commanded = self.commands.iter().rposition(|command| command.leads_to == state);
        if let Some(place) = commanded {
            self.commands.drain(..=place);
        }
        self.commands.retain(|command| now.0 <= command.at.0 + QUEUED * 4);
        let Some(before) = before.filter(|before| *before != state && commanded.is_none()) else {
            if state != State::PreOperational {
                self.may_start = false;
            }
            return;
        };
        let starts_itself = std::mem::take(&mut self.may_start)
            && (before, state) == (State::PreOperational, State::Operational);
        let by_error = matches!(
            (before, state),
            (State::Operational, State::PreOperational | State::Stopped)
                | (State::PreOperational, State::Stopped)
        );
        if starts_itself || by_error && explained {
            self.explained = 0;
            return;
        }
        let reason = if by_error { "an NMT command or an EMCY before it" } else { "an NMT command" };
        findings.push((Rule::NmtState, format!("{} becomes {} without {reason}", name(before), name(state))));
    }

    /// The state that 1029h demands (0 Pre-operational, 2 Stopped) is shown by the second heartbeat after the EMCY.
    fn follow_demand(&mut self, state: State, behaviour: Option<u32>, findings: &mut Findings) {
        let Some(demand) = &mut self.demand else { return };
        demand.heartbeats += 1;
        let is_met = match behaviour {
            Some(0) => state != State::Operational,
            Some(2) => state == State::Stopped,
            _ => true,
        };
        if is_met {
            self.demand = None;
        } else if demand.heartbeats >= 2 {
            let Demand { code, class, .. } = *demand;
            self.demand = None;
            let behaviour = behaviour.unwrap_or(0);
            let text = format!("{} after EMCY {code:04X}h, 1029h:{class} is {behaviour}", name(state));
            findings.push((Rule::ErrorBehaviour, text));
        }
    }

    /// A TPDO was sent: only Operational has PDOs.
    pub(crate) fn pdo(&mut self, now: Instant, findings: &mut Findings) {
        let Some(state) = self.shown.filter(|state| *state != State::Operational) else { return };
        let is_started = |command: &Command| command.leads_to == State::Operational;
        let was_queued = |command: &Command| command.at.0 + QUEUED >= now.0;
        if self.may_start
            || self.explained == EXPLAINED
            || self.commands.last().is_some_and(is_started)
            || self.commands.iter().any(was_queued)
        {
            return;
        }
        findings.push((Rule::NmtState, format!("a TPDO in {}", name(state))));
    }

    /// The SDO server has answered: Stopped has no SDO.
    pub(crate) fn sdo(&mut self, findings: &mut Findings) {
        if self.shown == Some(State::Stopped) && self.commands.is_empty() {
            findings.push((Rule::NmtState, "an SDO response in Stopped".to_owned()));
        }
    }
}

pub(crate) fn name(state: State) -> &'static str {
    match state {
        State::Initialising => "Initialising",
        State::PreOperational => "Pre-operational",
        State::Operational => "Operational",
        State::Stopped => "Stopped",
    }
}
