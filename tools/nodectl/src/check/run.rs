//! Runs checks one after the other, and puts the device back.

use canopen::nmt::{Command, State};
use canopen::{Duration, NodeId};

use super::subject::Refusal;
use super::verdict::ensure;
use super::{Check, Effect, Level, Outcome, Stop, Subject, Verdict};
use crate::Logged;
use crate::bus::BusError;
use crate::configuration::{Configuration, is_parameter, plan};
use crate::object::Place;
use crate::value::Value;

/// Frames that are kept of a check that did not pass: the last ones, where the deviation is.
const KEPT: usize = 250;

/// How long the bus is listened to before the first check: longer than a usual heartbeat.
const LOOK: u64 = 1200;

/// Which checks, and what they may do.
#[derive(Clone, Debug)]
pub struct Options {
    /// The checks in their order.
    pub checks: Vec<Check>,
    /// The strongest effect that is allowed; checks with a stronger one are skipped.
    pub allowed: Effect,
}

/// The result of one check.
#[derive(Clone, Debug)]
pub struct Result {
    /// The check.
    pub check: Check,
    /// What came of it.
    pub verdict: Verdict,
    /// How long it took, by the clock of the bus.
    pub time: Duration,
    /// The frames of a check that failed.
    pub frames: Vec<Logged>,
}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// The device.
    pub node: NodeId,
    /// Of all checks, in their order.
    pub results: Vec<Result>,
    /// What the device did not take back after the run.
    pub left_behind: Vec<String>,
}

impl Run {
    /// How many checks have this verdict, by its word.
    #[must_use]
    pub fn count(&self, word: &str) -> usize {
        self.results.iter().filter(|result| result.verdict.word() == word).count()
    }
}

/// Runs the checks. `progress` is told each result.
///
/// # Errors
/// The device does not answer at all, or the bus is lost.
pub fn run(subject: &mut Subject<'_>, options: &Options, mut progress: impl FnMut(&Result)) -> Outcome<Run> {
    let before = subject.begin()?;
    let mut results = Vec::new();
    for check in &options.checks {
        let result = if check.effect > options.allowed { skipped(*check) } else { one(subject, *check)? };
        progress(&result);
        results.push(result);
    }
    let left_behind = subject.end(&before)?;
    Ok(Run { node: subject.node(), results, left_behind })
}

fn skipped(check: Check) -> Result {
    let reason = match check.effect {
        Effect::Stores => "it writes the memory of the device, which was not allowed (--yes)",
        _ => "it restarts the device, which was not allowed (--yes)",
    };
    Result { check, verdict: Verdict::Skipped(reason.to_owned()), time: Duration(0), frames: Vec::new() }
}

fn one(subject: &mut Subject<'_>, check: Check) -> std::result::Result<Result, BusError> {
    let start = subject.network.now();
    subject.network.begin_log();
    let tried = subject.tidy().and_then(|()| (check.run)(subject));
    let tidied = subject.tidy().and_then(|()| subject.put_back());
    // A check that was skipped has to put back as well.
    let outcome = match (tried, tidied) {
        (Ok(()) | Err(Stop::Skipped(_)), Err(stop)) => Err(stop),
        (tried, _) => tried,
    };
    let verdict = verdict(outcome, check.level)?;
    let log = subject.network.log();
    let kept = if verdict.deviation().is_some() { log.len().min(KEPT) } else { 0 };
    let frames = log[log.len() - kept..].to_vec();
    let time = Duration(subject.network.now().0 - start.0);
    Ok(Result { check, verdict, time, frames })
}

fn verdict(outcome: Outcome, level: Level) -> std::result::Result<Verdict, BusError> {
    Ok(match outcome {
        Ok(()) => Verdict::Passed,
        Err(Stop::Failed(deviation)) if level == Level::Recommended => Verdict::Recommended(deviation),
        Err(Stop::Failed(deviation)) => Verdict::Failed(deviation),
        Err(Stop::Skipped(reason)) => Verdict::Skipped(reason),
        Err(Stop::Bus(error)) => return Err(error),
    })
}

/// What is put back after a run.
struct Before {
    /// `None` where nothing told the state.
    state: Option<State>,
    configuration: Configuration,
}

impl Subject<'_> {
    /// Looks at the device before anything is changed.
    fn begin(&mut self) -> Outcome<Before> {
        self.network.begin_log();
        self.look_round(LOOK)?;
        let state = self.present_state()?;
        self.tidy()?;
        self.answer([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
        Ok(Before { state, configuration: self.configuration()? })
    }

    /// The state that a heartbeat tells. A device without one gets one for a moment.
    fn present_state(&mut self) -> Outcome<Option<State>> {
        let told = |subject: &Subject<'_>| {
            subject.network.log().iter().rev().find_map(|logged| {
                let heard = logged.frame.id() == subject.error_control() && !logged.is_sent;
                heard.then(|| logged.frame.data().first().copied()).flatten()
            })
        };
        if told(self).is_none() && self.ask_within([0x40, 0x17, 0x10, 0, 0, 0, 0, 0], 500)?.is_some() {
            let result = self.beat(50).and_then(|()| self.pass(200));
            if let Err(Stop::Bus(error)) = result {
                return Err(error.into());
            }
            self.put_back()?;
        }
        let state = told(self).and_then(|told| State::from_code(told & 0x7F));
        Ok(state.filter(|state| *state != State::Initialising))
    }

    /// Where every check begins.
    fn tidy(&mut self) -> Outcome {
        self.network.forget();
        self.enter(State::PreOperational)?;
        if !self.is_served()? {
            // One way out of Stopped may be broken; the other leads through Operational.
            self.enter(State::Operational)?;
            self.enter(State::PreOperational)?;
        }
        Ok(())
    }

    fn configuration(&mut self) -> Outcome<Configuration> {
        let Ok(sheet) = self.sheet() else { return Ok(Configuration::default()) };
        let mut values = Configuration::default();
        for entry in sheet.entries().filter(|entry| is_parameter(entry)) {
            if let Ok(bytes) = self.try_read(entry.index, entry.sub).unwrap_or(Err(Refusal(0))) {
                values.values.insert((entry.index, entry.sub), Value::decode(&bytes, entry.data_type));
            }
        }
        Ok(values)
    }

    /// Puts back what a restart has lost, and the state. What the device does not take.
    fn end(&mut self, before: &Before) -> Outcome<Vec<String>> {
        self.tidy()?;
        let left = self.apply(&before.configuration)?;
        if let Some(state @ (State::Operational | State::Stopped)) = before.state {
            self.enter(state)?;
        }
        self.network.end_log();
        Ok(left)
    }

    /// Writes what differs from a configuration; what the device does not take.
    fn apply(&mut self, wanted: &Configuration) -> Outcome<Vec<String>> {
        let mut left = Vec::new();
        let Ok(sheet) = self.sheet() else { return Ok(left) };
        let now = self.configuration()?;
        for write in plan(&sheet, &now, wanted) {
            let Some(entry) = sheet.get(write.at.index, write.at.sub) else { continue };
            let bytes = write.value.encode(entry.data_type);
            match self.try_write(write.at.index, write.at.sub, &bytes) {
                Ok(Ok(())) => (),
                Ok(Err(refusal)) => left.push(format!("{}: {refusal}", Place(write.at))),
                Err(Stop::Bus(error)) => return Err(error.into()),
                Err(_) => left.push(format!("{}: no correct answer", Place(write.at))),
            }
        }
        Ok(left)
    }

    /// Does something while the device has the values that it was delivered with. What was saved before is saved again.
    pub(super) fn with_defaults(&mut self, does: impl FnOnce(&mut Self) -> Outcome) -> Outcome {
        self.sheet()?;
        self.need(0x1010, 1)?;
        self.need(0x1011, 1)?;
        self.reset(Command::ResetNode)?;
        let saved = self.configuration()?;
        self.write(0x1011, 1, b"load")?;
        self.reset(Command::ResetNode)?;
        let kept = self.written.len();
        let done = does(self);
        // What was written goes with the values that are saved again.
        self.written.truncate(kept);
        self.tidy()?;
        let has_changed = !saved.differences(&self.configuration()?).is_empty();
        let left = self.apply(&saved)?;
        ensure(left.is_empty(), "the saved values are taken back", left.join(", "))?;
        if has_changed {
            self.write(0x1010, 1, b"save")?;
        }
        done
    }
}
