//! Runs checks one after the other, and restores the device.

use canopen::nmt::{Command, State};
use canopen::{Duration, NodeId};

use super::subject::{Refusal, Values, ensure, fail, skip};
use super::{Check, Effect, Level, Outcome, Stop, Subject, Verdict};
use crate::Logged;
use crate::bus::BusError;
use crate::configuration::is_parameter;
use crate::object::{Place, at};

/// The number of frames that are kept of a check that did not pass. The last frames are kept, because they show the
/// deviation.
const KEPT: usize = 250;

/// How long to listen to the bus before the first check: longer than a usual heartbeat period.
const LOOK: u64 = 1200;

/// With a longer stall of this computer, the adapter or a simulated bus, a deviation may be one of the measurement.
const STEADY: Duration = Duration::from_millis(5);

/// The reason of the checks that an interruption has ended or skipped.
const INTERRUPTED: &str = "the run was interrupted";

/// How often a check is run that has found a deviation during a stall.
const TRIES: usize = 5;

/// The checks to run, and the effects that they may have.
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
    /// The verdict.
    pub verdict: Verdict,
    /// The duration of the check, by the clock of the bus.
    pub time: Duration,
    /// The frames of a check that failed.
    pub frames: Vec<Logged>,
}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// The device.
    pub node: NodeId,
    /// The results of all checks, in their order.
    pub results: Vec<Result>,
    /// The values that the device refused to take back after the run.
    pub left_behind: Vec<String>,
    /// Whether the user has interrupted the run. The checks after the interruption are skipped.
    pub is_interrupted: bool,
}

impl Run {
    /// The number of checks with this verdict, by its word.
    #[must_use]
    pub fn count(&self, word: &str) -> usize {
        self.results.iter().filter(|result| result.verdict.word() == word).count()
    }
}

/// Runs the checks. `progress` is called with each result.
///
/// # Errors
/// The device does not answer at all, or the bus is lost.
pub fn run(subject: &mut Subject<'_>, options: &Options, mut progress: impl FnMut(&Result)) -> Outcome<Run> {
    subject.may_store = options.allowed >= Effect::Stores;
    let before = subject.sheltered(Subject::begin)?;
    let mut results = Vec::new();
    for check in &options.checks {
        let reason = reason(*check, options.allowed).or(subject.is_interrupted().then_some(INTERRUPTED));
        let result = match reason {
            Some(reason) => skipped(*check, reason),
            None => one(subject, *check)?,
        };
        progress(&result);
        results.push(result);
    }
    let is_interrupted = results.iter().any(|result| result.verdict == Verdict::Skipped(INTERRUPTED.into()));
    let mut left_behind = subject.sheltered(|subject| subject.end(&before))?;
    left_behind.append(&mut subject.not_restored);
    left_behind.sort();
    left_behind.dedup();
    Ok(Run { node: subject.node(), results, left_behind, is_interrupted })
}

/// Why a check is skipped that may not have its effect.
fn reason(check: Check, allowed: Effect) -> Option<&'static str> {
    let reason = match check.effect {
        Effect::Stores => "it writes the memory of the device, which was not allowed (--yes)",
        _ => "it restarts the device, which was not allowed (--yes)",
    };
    (check.effect > allowed).then_some(reason)
}

fn skipped(check: Check, reason: &str) -> Result {
    Result { check, verdict: Verdict::Skipped(reason.to_owned()), time: Duration(0), frames: Vec::new() }
}

/// Runs a check. A deviation during a stall does not count, as long as the check can be run again.
fn one(subject: &mut Subject<'_>, check: Check) -> std::result::Result<Result, BusError> {
    let start = subject.network.now();
    let mut verdict = once(subject, check)?;
    for _ in 1..TRIES {
        if verdict.deviation().is_none() || subject.network.stall() <= STEADY {
            break;
        }
        verdict = once(subject, check)?;
    }
    let stall = subject.network.stall();
    if let Some(deviation) = verdict.deviation_mut().filter(|_| stall > STEADY) {
        deviation.seen += &format!(", while this computer or the bus stood still for {} ms", stall.0 / 1000);
    }
    let log = subject.network.log();
    let kept = if verdict.deviation().is_some() { log.len().min(KEPT) } else { 0 };
    let frames = log[log.len() - kept..].to_vec();
    let time = Duration(subject.network.now().0 - start.0);
    Ok(Result { check, verdict, time, frames })
}

fn once(subject: &mut Subject<'_>, check: Check) -> std::result::Result<Verdict, BusError> {
    subject.network.begin_log();
    let tried = subject.tidy().and_then(|()| (check.run)(subject));
    let tidied = subject.restoring(|subject| subject.tidy().and_then(|()| subject.put_back()));
    // A skipped check has to restore its values, too.
    let outcome = match (tried, tidied) {
        (Ok(()) | Err(Stop::Skipped(_)), Err(stop)) => Err(stop),
        (tried, _) => tried,
    };
    verdict(outcome, check.level)
}

fn verdict(outcome: Outcome, level: Level) -> std::result::Result<Verdict, BusError> {
    Ok(match outcome {
        Ok(()) => Verdict::Passed,
        Err(Stop::Failed(deviation)) if level == Level::Recommended => Verdict::Recommended(deviation),
        Err(Stop::Failed(deviation)) => Verdict::Failed(deviation),
        Err(Stop::Skipped(reason)) => Verdict::Skipped(reason),
        Err(Stop::Interrupted) => Verdict::Skipped(INTERRUPTED.to_owned()),
        Err(Stop::Bus(error)) => return Err(error),
    })
}

/// The state of the device before the run, which is restored after it.
struct Before {
    /// `None` where no heartbeat has told the state.
    state: Option<State>,
    values: Values,
}

impl Subject<'_> {
    /// Reads the state and the configuration of the device before any change.
    fn begin(&mut self) -> Outcome<Before> {
        self.network.begin_log();
        self.look_round(LOOK)?;
        let state = self.present_state()?;
        self.tidy()?;
        self.answer([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
        Ok(Before { state, values: self.parameters()? })
    }

    /// The NMT state that a heartbeat tells. For a device without a heartbeat, the heartbeat is switched on for a
    /// moment.
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

    /// Brings the device into the state in which every check begins.
    fn tidy(&mut self) -> Outcome {
        self.network.forget();
        self.enter(State::PreOperational)?;
        if !self.is_served()? {
            // If the device cannot leave Stopped by this command, try the way through Operational.
            self.enter(State::Operational)?;
            self.enter(State::PreOperational)?;
        }
        Ok(())
    }

    /// The values of the parameters that the data sheet has.
    fn parameters(&mut self) -> Outcome<Values> {
        let Ok(sheet) = self.sheet() else { return Ok(Values::new()) };
        let mut values = Values::new();
        for entry in sheet.entries().filter(|entry| is_parameter(entry)) {
            if let Ok(bytes) = self.try_read(entry.index, entry.sub).unwrap_or(Err(Refusal(0))) {
                values.insert((entry.index, entry.sub), bytes);
            }
        }
        Ok(values)
    }

    /// Restores the values that a restart has lost, and the state. Returns the values that the device does not take
    /// back.
    fn end(&mut self, before: &Before) -> Outcome<Vec<String>> {
        self.tidy()?;
        let left = self.restore(&before.values)?;
        if let Some(state @ (State::Operational | State::Stopped)) = before.state {
            self.enter(state)?;
        }
        self.network.end_log();
        Ok(left)
    }

    /// Writes the parameters that differ. Returns those that the device does not take, and all that differ if a transfer
    /// fails.
    fn restore(&mut self, wanted: &Values) -> Outcome<Vec<String>> {
        let now = self.parameters()?;
        let differs = |(key, bytes): &(&(u16, u8), &Vec<u8>)| now.get(*key) != Some(*bytes);
        let different: Values =
            wanted.iter().filter(differs).map(|(key, bytes)| (*key, bytes.clone())).collect();
        match self.bring(&different) {
            Ok(left) => Ok(left),
            Err(Stop::Bus(error)) => Err(error.into()),
            Err(_) => {
                let places = different.keys().map(|key| Place(at(key.0, key.1)));
                Ok(places.map(|place| format!("{place}: no correct answer")).collect())
            }
        }
    }

    /// Runs a function that judges a default. If the user has given the object another value, the defaults are restored
    /// first, which the user has to allow.
    pub(super) fn with_default_of(
        &mut self,
        (index, sub): (u16, u8),
        default: u32,
        does: impl FnOnce(&mut Self) -> Outcome,
    ) -> Outcome {
        if self.number(index, sub)? == default {
            return does(self);
        }
        if !self.may_store {
            let place = Place(at(index, sub));
            return Err(skip(format!(
                "{place} has another value, and restoring its default was not allowed (--yes)"
            )));
        }
        match self.with_defaults(does) {
            // A device that cannot restore its defaults has this value.
            Err(Stop::Skipped(reason)) => Err(fail(format!("the default {default:X}h"), reason)),
            outcome => outcome,
        }
    }

    /// Runs a function while the device has its default values. Restores and saves the values that were saved before.
    pub(super) fn with_defaults(&mut self, does: impl FnOnce(&mut Self) -> Outcome) -> Outcome {
        self.sheet()?;
        self.need(0x1010, 1)?;
        self.need(0x1011, 1)?;
        self.reset(Command::ResetNode)?;
        let saved = self.sheltered(Self::parameters)?;
        self.go_on()?;
        self.sheltered(|s| {
            s.write(0x1011, 1, b"load")?;
            s.reset(Command::ResetNode)
        })?;
        let kept = self.written.len();
        let done = does(self);
        // The values that the function has written need no restoring of their own: all saved values are written back
        // below.
        self.written.truncate(kept);
        self.restoring(|s| s.save_again(&saved))?;
        done
    }

    /// Brings back and saves the values that were saved before the defaults were restored.
    fn save_again(&mut self, saved: &Values) -> Outcome {
        if self.is_interrupted() {
            // An order to restore the defaults may wait for the next restart.
            self.reset(Command::ResetNode)?;
        }
        self.tidy()?;
        let has_changed = *saved != self.parameters()?;
        let left = self.restore(saved)?;
        // The values that the device has accepted are saved, even if it refuses the others.
        if has_changed {
            self.write(0x1010, 1, b"save")?;
        }
        ensure(left.is_empty(), "the saved values are taken back", left.join(", "))
    }
}
