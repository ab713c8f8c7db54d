//! What each exception handler did: how often, how much, how late.

use canbus::Time;

use crate::exception::Exception;
use crate::trace::Trace;

/// Figures of one exception, or of thread mode, since power-on or [`Stats::clear`].
///
/// Instructions and cycles are exclusive: what ran at this exception, not what preempted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activity {
    /// How often it was entered.
    pub entries: u64,
    /// Instructions of all activations.
    pub instructions: u64,
    /// Cycles of all activations, with entry and exit.
    pub cycles: u64,
    /// Most instructions of one finished activation.
    pub worst_instructions: u64,
    /// Most cycles of one finished activation.
    pub worst_cycles: u64,
    /// Shortest span from pending to the first instruction; [`Time::NEVER`] before the first entry.
    pub least_latency: Time,
    /// Longest span from pending to the first instruction.
    pub worst_latency: Time,
    /// Longest span from pending to the end of the handler, with all that preempted it.
    pub worst_response: Time,
    /// Shortest span between the first instructions of two activations; [`Time::NEVER`] before the second.
    pub least_interval: Time,
    /// Longest span between the first instructions of two activations.
    pub worst_interval: Time,
    /// The first instruction of the first activation.
    pub first_entry: Time,
    /// The first instruction of the last activation.
    pub last_entry: Time,
}

impl Activity {
    const NONE: Activity = Activity {
        entries: 0,
        instructions: 0,
        cycles: 0,
        worst_instructions: 0,
        worst_cycles: 0,
        least_latency: Time::NEVER,
        worst_latency: Time::ZERO,
        worst_response: Time::ZERO,
        least_interval: Time::NEVER,
        worst_interval: Time::ZERO,
        first_entry: Time::NEVER,
        last_entry: Time::ZERO,
    };

    /// By how much the latency varies.
    pub fn jitter(&self) -> Time {
        if self.entries == 0 { Time::ZERO } else { self.worst_latency.since(self.least_latency) }
    }

    fn started(&mut self, pended: Time, now: Time) {
        let latency = now.since(pended);
        self.least_latency = self.least_latency.min(latency);
        self.worst_latency = self.worst_latency.max(latency);
        if self.first_entry == Time::NEVER {
            self.first_entry = now;
        } else {
            let interval = now.since(self.last_entry);
            self.least_interval = self.least_interval.min(interval);
            self.worst_interval = self.worst_interval.max(interval);
        }
        self.last_entry = now;
    }

    fn ended(&mut self, run: &Activation, now: Time) {
        self.instructions += run.instructions;
        self.cycles += run.cycles;
        self.worst_instructions = self.worst_instructions.max(run.instructions);
        self.worst_cycles = self.worst_cycles.max(run.cycles);
        self.worst_response = self.worst_response.max(now.since(run.pended));
    }
}

/// One handler that has begun and not ended.
#[derive(Clone, Copy, Debug)]
struct Activation {
    exception: Exception,
    instructions: u64,
    cycles: u64,
    pended: Time,
    started: bool,
}

impl Activation {
    fn new(exception: Exception, pended: Time) -> Activation {
        Activation { exception, instructions: 0, cycles: 0, pended, started: false }
    }
}

/// Figures of a machine.
#[derive(Clone, Debug)]
pub struct Stats {
    /// Instructions in all.
    pub instructions: u64,
    /// Cycles that the core worked.
    pub cycles: u64,
    /// Time that the core slept.
    pub asleep: Time,
    pub(crate) trace: Trace,
    activities: Vec<Activity>,
    /// The running activation; those it preempted lie in `preempted`.
    current: Activation,
    preempted: Vec<Activation>,
    since: Time,
}

impl Stats {
    pub(crate) fn new() -> Stats {
        Stats {
            instructions: 0,
            cycles: 0,
            asleep: Time::ZERO,
            trace: Trace::new(),
            activities: vec![Activity::NONE; Exception::COUNT],
            current: Activation { started: true, ..Activation::new(Exception::THREAD, Time::ZERO) },
            preempted: Vec::new(),
            since: Time::ZERO,
        }
    }

    /// Figures of one exception; [`Exception::THREAD`] is thread mode. Activations that have not ended are not in
    /// `worst_*`, and what they ran so far is included in the totals.
    pub fn of(&self, exception: Exception) -> Activity {
        let mut activity = self.activities[exception.index()];
        for run in self.preempted.iter().chain([&self.current]).filter(|run| run.exception == exception) {
            activity.instructions += run.instructions;
            activity.cycles += run.cycles;
        }
        activity
    }

    /// All exceptions that were entered, and thread mode.
    pub fn iter(&self) -> impl Iterator<Item = (Exception, Activity)> + '_ {
        let all = (0..Exception::COUNT as u8).map(|number| (Exception(number), self.of(Exception(number))));
        all.filter(|(exception, activity)| *exception == Exception::THREAD || activity.entries != 0)
    }

    /// A hash of all exception entries with their times and return addresses: equal for equal runs.
    pub fn trace(&self) -> u64 {
        self.trace.hash()
    }

    /// When counting began.
    pub fn since(&self) -> Time {
        self.since
    }

    /// The share of the time since [`Stats::since`] that the core did not sleep, 0 to 1.
    #[allow(clippy::cast_precision_loss)]
    pub fn load(&self, now: Time) -> f64 {
        let span = now.since(self.since);
        if span == Time::ZERO { 0.0 } else { 1.0 - self.asleep.0 as f64 / span.0 as f64 }
    }

    /// Counts from zero again; running activations count from here.
    pub(crate) fn clear(&mut self, now: Time) {
        self.activities.fill(Activity::NONE);
        (self.instructions, self.cycles) = (0, 0);
        self.asleep = Time::ZERO;
        self.since = now;
        for run in self.preempted.iter_mut().chain([&mut self.current]) {
            run.instructions = 0;
            run.cycles = 0;
        }
    }

    #[inline]
    pub(crate) fn ran(&mut self, instructions: u32, cycles: u32) {
        let (instructions, cycles) = (u64::from(instructions), u64::from(cycles));
        self.instructions += instructions;
        self.cycles += cycles;
        self.current.instructions += instructions;
        self.current.cycles += cycles;
    }

    pub(crate) fn slept(&mut self, span: Time) {
        self.asleep += span;
    }

    pub(crate) fn entered(&mut self, exception: Exception, pended: Time) {
        self.activities[exception.index()].entries += 1;
        self.preempted.push(std::mem::replace(&mut self.current, Activation::new(exception, pended)));
    }

    /// The core is about to run on: the first instruction of the current handler, if it has not begun.
    pub(crate) fn running(&mut self, now: Time) {
        if !self.current.started {
            self.current.started = true;
            self.activities[self.current.exception.index()].started(self.current.pended, now);
        }
    }

    pub(crate) fn left(&mut self, now: Time) {
        let run = self.current;
        self.activities[run.exception.index()].ended(&run, now);
        if let Some(below) = self.preempted.pop() {
            self.current = below;
        }
    }

    /// The exception whose handler runs.
    pub(crate) fn current(&self) -> Exception {
        self.current.exception
    }

    /// A reset ends every activation.
    pub(crate) fn reset(&mut self, now: Time) {
        while !self.preempted.is_empty() {
            self.left(now);
        }
    }
}
