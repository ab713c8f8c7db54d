//! Counters of the core.

use canbus::Time;

use crate::exception::Exception;

/// The counters of one exception, without the exceptions that preempted it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activity {
    /// Number of entries.
    pub entries: u64,
    /// Total instructions.
    pub instructions: u64,
    /// Total modelled cycles.
    pub cycles: u64,
    /// Most instructions in one activation.
    pub worst_instructions: u64,
    /// Most cycles in one activation.
    pub worst_cycles: u64,
    /// Most cycles in two activations in a row.
    pub worst_pair: u64,
    /// Cycles of the last activation.
    last_cycles: u64,
    /// Longest time from the request to the first instruction.
    pub worst_latency: Time,
    /// Longest part of this time in which neither this exception nor one of the same or a higher priority ran: less urgent code that
    /// masks it, and waits for the flash.
    pub worst_blocking: Time,
    /// Longest time from the request to the end of the activation that serves it.
    pub worst_response: Time,
    /// Instant of the latest entry since the last reset.
    last_entry: Option<Time>,
    /// Number of intervals: pairs of entries in a row without a reset between them.
    pub intervals: u64,
    /// Sum of the intervals.
    pub interval_sum: Time,
    /// Shortest interval; zero before the first.
    pub shortest_interval: Time,
    /// Longest interval; zero before the first.
    pub longest_interval: Time,
}

impl Activity {
    fn note_entry(&mut self, latency: Time, at: Time) {
        self.worst_latency = self.worst_latency.max(latency);
        if let Some(last) = self.last_entry.replace(at) {
            let interval = at.since(last);
            let shortest = if self.intervals == 0 { interval } else { self.shortest_interval };
            self.shortest_interval = shortest.min(interval);
            self.longest_interval = self.longest_interval.max(interval);
            self.interval_sum += interval;
            self.intervals += 1;
        }
        self.entries += 1;
    }
}

/// Counters since power-on.
#[derive(Clone, Debug)]
pub struct Stats {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles awake.
    pub cycles: u64,
    /// Time spent in WFI.
    pub asleep: Time,
    /// Counters by exception number. Thread mode has no entry and no end, so its counters stay zero.
    pub exceptions: [Activity; Exception::COUNT],
    /// Exceptions that followed another without unstacking.
    pub tail_chained: u64,
    /// A hash over every exception entry with its time and return address: equal runs have equal hashes.
    pub trace: u64,
    running: Running,
    /// Cycles of handlers by their priority, 0 first; Thread mode is behind them.
    by_level: [u64; LEVELS + 1],
    /// The cycles of all handlers of the same or a higher priority, at the time of the last request of each exception.
    at_request: [u64; Exception::COUNT],
    /// The activations that continue after `running`; Thread mode first.
    preempted: Vec<Running>,
}

/// The priorities of the chip.
const LEVELS: usize = 16;

/// The circumstances of an entry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// The instant of the request.
    pub(crate) requested: Time,
    /// The priority, 0 for the highest.
    pub(crate) level: usize,
    /// The length of a cycle.
    pub(crate) cycle: Time,
}

/// One activation that has not ended. It begins with its request, not with its entry: a request that comes while the
/// handler runs is served by the next activation, and waits for it meanwhile.
#[derive(Clone, Copy, Debug)]
struct Running {
    exception: Exception,
    level: usize,
    requested: Time,
    instructions: u64,
    cycles: u64,
}

impl Running {
    fn new(exception: Exception, level: usize, requested: Time) -> Running {
        Running { exception, level, requested, instructions: 0, cycles: 0 }
    }
}

impl Default for Stats {
    fn default() -> Stats {
        Stats {
            instructions: 0,
            cycles: 0,
            asleep: Time::ZERO,
            exceptions: [Activity::default(); Exception::COUNT],
            tail_chained: 0,
            trace: 0xCBF2_9CE4_8422_2325,
            running: Running::new(Exception::THREAD, LEVELS, Time::ZERO),
            by_level: [0; LEVELS + 1],
            at_request: [0; Exception::COUNT],
            preempted: Vec::new(),
        }
    }
}

impl Stats {
    /// The activity of one exception.
    pub fn of(&self, exception: Exception) -> &Activity {
        &self.exceptions[usize::from(exception.0)]
    }

    pub(crate) fn forget_worst(&mut self) {
        for activity in &mut self.exceptions {
            activity.worst_instructions = 0;
            activity.worst_cycles = 0;
            activity.worst_pair = 0;
            activity.worst_blocking = Time::ZERO;
            activity.worst_latency = Time::ZERO;
            activity.worst_response = Time::ZERO;
        }
    }

    #[inline]
    pub(crate) fn ran(&mut self, instructions: u32, cycles: u32) {
        self.instructions += u64::from(instructions);
        self.cycles += u64::from(cycles);
        self.running.instructions += u64::from(instructions);
        self.running.cycles += u64::from(cycles);
        self.by_level[self.running.level] += u64::from(cycles);
    }

    /// Cycles of handlers of this priority and of higher ones.
    fn urgent_cycles(&self, level: usize) -> u64 {
        self.by_level[..=level.min(LEVELS - 1)].iter().sum()
    }

    /// An exception with this priority is requested.
    pub(crate) fn requested(&mut self, exception: Exception, level: usize) {
        self.at_request[usize::from(exception.0)] = self.urgent_cycles(level);
    }

    /// An exception begins. `entry` has its priority and the length of a cycle.
    pub(crate) fn entered(&mut self, exception: Exception, entry: Entry, at: Time, pc: u32) {
        let Entry { requested, level, cycle } = entry;
        let urgent = self.urgent_cycles(level) - self.at_request[usize::from(exception.0)];
        let blocking = Time(at.since(requested).0.saturating_sub(urgent * cycle.0));
        let activity = &mut self.exceptions[usize::from(exception.0)];
        activity.note_entry(at.since(requested), at);
        activity.worst_blocking = activity.worst_blocking.max(blocking);
        let preempted = std::mem::replace(&mut self.running, Running::new(exception, level, requested));
        self.preempted.push(preempted);
        for word in [u64::from(exception.0), at.0, u64::from(pc)] {
            // FNV-1a over words.
            self.trace = (self.trace ^ word).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }

    pub(crate) fn left(&mut self, at: Time) {
        let Some(preempted) = self.preempted.pop() else { return };
        let ended = std::mem::replace(&mut self.running, preempted);
        let Running { exception, requested, instructions, cycles, .. } = ended;
        let activity = &mut self.exceptions[usize::from(exception.0)];
        activity.instructions += instructions;
        activity.cycles += cycles;
        activity.worst_instructions = activity.worst_instructions.max(instructions);
        activity.worst_cycles = activity.worst_cycles.max(cycles);
        activity.worst_pair = activity.worst_pair.max(activity.last_cycles + cycles);
        activity.last_cycles = cycles;
        activity.worst_response = activity.worst_response.max(at.since(requested));
    }

    /// A reset ends every activation. The time until the next entry is no interval.
    pub(crate) fn unwound(&mut self, at: Time) {
        while !self.preempted.is_empty() {
            self.left(at);
        }
        self.exceptions.iter_mut().for_each(|activity| activity.last_entry = None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_is_between_two_series_of_intervals() {
        let mut stats = Stats::default();
        let exception = Exception::irq(56);
        let enter = |stats: &mut Stats, at| {
            let at = Time::from_millis(at);
            stats.entered(exception, Entry { requested: at, level: 0, cycle: Time(1) }, at, 0);
            stats.left(at);
        };
        for at in [10, 11, 13] {
            enter(&mut stats, at);
        }
        stats.unwound(Time::from_millis(14));
        for at in [9000, 9001] {
            enter(&mut stats, at);
        }
        let activity = stats.of(exception);
        assert_eq!((activity.entries, activity.intervals), (5, 3));
        assert_eq!(activity.interval_sum, Time::from_millis(4));
        assert_eq!(activity.shortest_interval, Time::from_millis(1));
        assert_eq!(activity.longest_interval, Time::from_millis(2));
    }
}
