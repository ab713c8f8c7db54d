//! The state that the hooks of the CPU library share with the run loop: clock, interrupt controller, system
//! registers, and the chip behind them.

use std::collections::{BTreeSet, VecDeque};

use canbus::Time;
use chip::{Breach, Effect, Peripherals};

use crate::accelerator::Accelerator;
use crate::cost::Costs;
use crate::engine::RAM;
use crate::estimate::Estimate;
use crate::exception::Exception;
use crate::mechanism::Mechanism;
use crate::memory::Memory as Bytes;
use crate::model::Model;
use crate::nvic::{Masks, Nvic};
use crate::posted::Posted;
use crate::profile::Profile;
use crate::scb::Scb;
use crate::seed::Bugs;
use crate::stats::{Entry, Stats};
use crate::stepping::Stepping;
use crate::systick::SysTick;
use crate::watch::Watch;

/// The reason why the CPU library was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halt {
    /// The run loop is needed: time, an effect, or an interrupt.
    Attention,
    /// A watched point is reached.
    Watched,
    /// The core branched to an EXC_RETURN value.
    ExceptionReturn,
    /// SVC was executed.
    SupervisorCall,
    /// BKPT.
    Breakpoint,
    /// An exception raised by the CPU library, for example for a forbidden access.
    Undefined,
    /// A usage fault with these status bits, detected before the instruction runs.
    Usage(u32),
    /// A data access to an address without a register or memory, detected by the chip or the system space.
    DataFault(u32),
}

/// An access to unmapped memory, as seen by the hook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unmapped {
    pub(crate) address: u32,
    pub(crate) fetch: bool,
    pub(crate) store: bool,
}

/// The state of the machine except the CPU's registers.
pub(crate) struct Core<P> {
    pub(crate) chip: P,
    pub(crate) memory: Bytes,
    pub(crate) now: Time,
    /// Length of a core cycle.
    pub(crate) cycle: Time,
    /// The instant at which the run loop must regain control.
    pub(crate) until: Time,
    /// The next deadline of the chip or SysTick; cached, because every block checks it.
    due: Time,
    /// Whether only time can stop the program before the next block, at `bound` at the earliest; cached for the same
    /// reason.
    calm: bool,
    bound: Time,
    pub(crate) nvic: Nvic,
    pub(crate) scb: Scb,
    pub(crate) systick: SysTick,
    pub(crate) stats: Stats,
    pub(crate) profile: Profile,
    /// The mode in which interrupts come between any two instructions.
    pub(crate) stepping: Option<Stepping>,
    /// Stores of the program on their way to a peripheral.
    pub(crate) posted: Posted,
    /// Bugs that a test has seeded into the program.
    pub(crate) bugs: Bugs,
    /// Points before which the program stops.
    pub(crate) watch: Option<Watch>,
    pub(crate) halt: Option<Halt>,
    pub(crate) unmapped: Option<Unmapped>,
    /// The page of a data access that the memory protection unit forbids.
    pub(crate) denied: Option<u32>,
    /// The address of a buffered store that failed: the fault is taken before the next block.
    pub(crate) lost_store: Option<u32>,
    /// Broken rules, each with its instant and the address of the code.
    pub(crate) breaches: VecDeque<(Time, u32, Breach)>,
    /// All of them so far: each is reported once.
    told: BTreeSet<Breach>,
    /// The address of the last counted code.
    pub(crate) place: u32,
    pub(crate) effects: VecDeque<Effect>,
    /// The instant at which each exception became pending, for its latency.
    pub(crate) pended: [Time; Exception::COUNT],
    pub(crate) costs: Costs,
    /// The caches of the flash, if their misses are counted.
    pub(crate) accelerator: Option<Accelerator>,
    /// The address of the next code if the program does not jump.
    pub(crate) ahead: u32,
    pub(crate) reset_requested: bool,
    /// The program has written BASEPRI, and the unimplemented bits are still to be cleared.
    pub(crate) wrote_basepri: bool,
    /// An exclusive access has begun since the monitor was last cleared.
    pub(crate) exclusive: bool,
    /// The emulator's own code is running, not the program.
    pub(crate) clearing_monitor: bool,
    pub(crate) without: Option<Mechanism>,
    /// Flash is busy while code in RAM runs: loads from flash must be detected.
    pub(crate) flash_closed: bool,
    /// Number of writes to the flash array.
    pub(crate) flash_changes: u64,
    cyccnt: Cyccnt,
}

/// The part of a [`crate::Moment`] that this structure holds.
pub(crate) struct CoreMoment<P> {
    chip: P,
    times: [Time; 4],
    nvic: Nvic,
    scb: Scb,
    systick: SysTick,
    stats: Stats,
    effects: VecDeque<Effect>,
    pended: [Time; Exception::COUNT],
    flags: [bool; 2],
    cyccnt: Cyccnt,
    ahead: u32,
    posted: Posted,
}

/// DWT_CYCCNT: its value at some instant, and whether it runs.
#[derive(Clone, Copy, Debug, Default)]
struct Cyccnt {
    at: Time,
    value: u32,
    runs: bool,
}

impl<P: Peripherals> Core<P> {
    pub(crate) fn new(chip: P, model: &Model) -> Core<P> {
        Core {
            chip,
            memory: Bytes::new(model),
            now: Time::ZERO,
            cycle: Time::of_cycle(16_000_000),
            until: Time::ZERO,
            due: Time::ZERO,
            calm: false,
            bound: Time::ZERO,
            nvic: Nvic::default(),
            scb: Scb::default(),
            systick: SysTick::default(),
            stats: Stats::default(),
            profile: Profile::default(),
            stepping: None,
            posted: Posted::default(),
            bugs: Bugs::default(),
            watch: None,
            halt: None,
            unmapped: None,
            denied: None,
            lost_store: None,
            breaches: VecDeque::new(),
            told: BTreeSet::new(),
            place: 0,
            effects: VecDeque::new(),
            pended: [Time::ZERO; Exception::COUNT],
            costs: Costs::new(Estimate::Modelled),
            accelerator: None,
            ahead: 0,
            reset_requested: false,
            wrote_basepri: false,
            exclusive: false,
            clearing_monitor: false,
            without: None,
            flash_closed: false,
            flash_changes: 0,
            cyccnt: Cyccnt::default(),
        }
    }

    /// The state that a program can see, and the time.
    pub(crate) fn moment(&self) -> CoreMoment<P>
    where
        P: Clone,
    {
        CoreMoment {
            chip: self.chip.clone(),
            times: [self.now, self.cycle, self.until, self.due],
            nvic: self.nvic.clone(),
            scb: self.scb.clone(),
            systick: self.systick.clone(),
            stats: self.stats.clone(),
            effects: self.effects.clone(),
            pended: self.pended,
            flags: [self.reset_requested, self.exclusive],
            cyccnt: self.cyccnt,
            ahead: self.ahead,
            posted: self.posted.clone(),
        }
    }

    /// Restores the state of a moment.
    pub(crate) fn go_back(&mut self, moment: &CoreMoment<P>)
    where
        P: Clone,
    {
        self.chip = moment.chip.clone();
        [self.now, self.cycle, self.until, self.due] = moment.times;
        self.nvic = moment.nvic.clone();
        self.scb = moment.scb.clone();
        self.systick = moment.systick.clone();
        self.stats = moment.stats.clone();
        self.effects.clone_from(&moment.effects);
        self.pended = moment.pended;
        [self.reset_requested, self.exclusive] = moment.flags;
        self.cyccnt = moment.cyccnt;
        self.ahead = moment.ahead;
        self.posted.clone_from(&moment.posted);
        self.halt = None;
        self.unmapped = None;
        self.lost_store = None;
    }

    /// Resets the core; the clock of virtual time and the counters go on.
    pub(crate) fn reset(&mut self) {
        self.nvic = Nvic::default();
        self.scb = Scb::default();
        self.systick = SysTick::default();
        self.posted = Posted::default();
        self.stats.unwound(self.now);
        self.halt = None;
        self.unmapped = None;
        self.lost_store = None;
        self.reset_requested = false;
        self.cyccnt = Cyccnt::default();
        self.cycle = Time::of_cycle(16_000_000);
        self.accelerator.iter_mut().for_each(Accelerator::clear);
    }

    /// Sets the estimate of cycles, from now on.
    pub(crate) fn set_estimate(&mut self, estimate: Estimate) {
        self.costs = Costs::new(estimate);
        self.accelerator = (estimate == Estimate::Worst).then(Accelerator::new);
    }

    pub(crate) fn estimate(&self) -> Estimate {
        self.costs.estimate
    }

    /// The exception to take now, if one can preempt.
    pub(crate) fn to_take(&self, masks: Masks) -> Option<Exception> {
        let nested = self.nvic.any_active();
        self.nvic.to_take(masks).filter(|_| !(nested && self.lacks(Mechanism::Preemption)))
    }

    pub(crate) fn lacks(&self, mechanism: Mechanism) -> bool {
        self.without == Some(mechanism)
    }

    /// The next instant at which the state changes without the program.
    pub(crate) fn deadline(&self) -> Time {
        self.chip.deadline().min(self.systick.deadline()).min(self.posted.deadline())
    }

    /// Whether the run loop has something to do before the next block runs.
    pub(crate) fn needs_attention(&self) -> bool {
        self.now >= self.until.min(self.due)
            || self.reset_requested
            || !self.effects.is_empty()
            || self.lost_store.is_some()
    }

    /// Whether nothing has come since the core began to sleep with these exceptions pending.
    pub(crate) fn is_as_it_slept(&self, pending: u128) -> bool {
        self.nvic.pending_set() == pending
            && self.nvic.has_seen(self.chip.lines())
            && self.effects.is_empty()
            && !self.reset_requested
            && self.lost_store.is_none()
    }

    /// Whether the next block may run without further checks. `false` does not mean that the block must stop.
    #[inline]
    pub(crate) fn is_undisturbed(&self) -> bool {
        self.calm && self.now < self.bound
    }

    /// Updates the cached checks after a change and before the program continues.
    pub(crate) fn look_again(&mut self) {
        self.bound = self.until.min(self.due);
        self.calm = self.halt.is_none()
            && self.lost_store.is_none()
            && self.effects.is_empty()
            && !self.reset_requested
            && !self.flash_closed
            && !self.nvic.could_preempt();
    }

    /// Makes the run loop take over before the next block.
    pub(crate) fn stop_for(&mut self, halt: Halt) {
        self.halt = Some(halt);
        self.calm = false;
    }

    /// Processes everything that is due, and samples the interrupt lines.
    pub(crate) fn advance(&mut self) {
        self.deliver();
        if self.chip.deadline() <= self.now {
            self.chip.advance(self.now, &self.memory);
        }
        if self.systick.advance(self.now) {
            self.pend(Exception::SYS_TICK);
        }
        self.settle();
    }

    /// Takes over the changes that a call into the chip has made.
    pub(crate) fn settle(&mut self) {
        while let Some(effect) = self.chip.effect() {
            self.effects.push_back(effect);
        }
        while let Some(breach) = self.chip.breach() {
            self.report(breach);
        }
        let before = self.nvic.pending_set();
        self.nvic.sample(self.chip.lines());
        self.stamp(self.nvic.pending_set() & !before);
        self.due_is_new();
    }

    /// Recomputes the next deadline.
    pub(crate) fn due_is_new(&mut self) {
        self.due = self.deadline();
        self.look_again();
    }

    /// The last store into the flash array that is still to be carried out.
    pub(crate) fn programmed(&self) -> Option<Effect> {
        let is_one = |effect: &&Effect| matches!(effect, Effect::Store { address, .. } if *address < RAM);
        self.effects.iter().rfind(is_one).cloned()
    }

    /// Records a broken rule with the current time and address, once.
    pub(crate) fn report(&mut self, breach: Breach) {
        if self.told.insert(breach) {
            self.breaches.push_back((self.now, self.place, breach));
        }
    }

    pub(crate) fn pend(&mut self, exception: Exception) {
        if !self.nvic.is_pending(exception) {
            self.stamp(exception.bit());
        }
        self.nvic.pend(exception);
        self.calm = false;
    }

    /// Records the instant at which these exceptions became pending.
    pub(crate) fn stamp(&mut self, mut fresh: u128) {
        while fresh != 0 {
            let exception = Exception(fresh.trailing_zeros() as u8);
            self.pended[usize::from(exception.0)] = self.now;
            self.stats.requested(exception, self.nvic.level(exception));
            fresh &= fresh - 1;
        }
    }

    /// Counts the entry of an exception that was requested at `requested`.
    pub(crate) fn count_entry(&mut self, exception: Exception, requested: Time, pc: u32) {
        let entry = Entry { requested, level: self.nvic.level(exception), cycle: self.cycle };
        self.stats.entered(exception, entry, self.now, pc);
    }

    pub(crate) fn spend(&mut self, instructions: u32, cycles: u32) {
        self.now += Time(self.cycle.0 * u64::from(cycles));
        self.stats.ran(instructions, cycles);
    }

    /// Extra cycles of code that is about to run: to refill the pipeline after a jump, and to wait for the flash.
    #[inline]
    pub(crate) fn fetch_cycles(&mut self, address: u32, size: u32) -> u32 {
        let in_a_row = std::mem::replace(&mut self.ahead, address + size) == address;
        let refill = if in_a_row { 0 } else { self.estimate().refill() };
        refill + self.flash_cycles(address, size, in_a_row)
    }

    /// The cycles that code waits for the flash.
    #[inline]
    fn flash_cycles(&mut self, address: u32, size: u32, in_a_row: bool) -> u32 {
        match &mut self.accelerator {
            Some(accelerator) if address < RAM => {
                let cycles = accelerator.fetch(address, size, in_a_row, self.chip.flash_access());
                self.tell_stale_lines();
                cycles
            }
            _ => 0,
        }
    }

    /// Reports that a cache has given what the flash no longer has.
    fn tell_stale_lines(&mut self) {
        if let Some((what, address)) = self.accelerator.as_mut().and_then(Accelerator::take_stale) {
            self.report(Breach::StaleCache { what, address });
        }
    }

    /// Adds the wait cycles for a constant in flash.
    pub(crate) fn wait_for_constant(&mut self, address: u32) {
        if let Some(accelerator) = &mut self.accelerator {
            let cycles = accelerator.load(address, self.chip.flash_access());
            self.tell_stale_lines();
            self.spend(0, cycles);
        }
    }

    /// Adds the wait cycles for an entry of the vector table, which is fetched like code.
    pub(crate) fn wait_for_vector(&mut self, address: u32) {
        let cycles = self.flash_cycles(address, 4, false);
        self.spend(0, cycles);
    }

    /// Adds the wait cycles for an access to a register of the chip.
    pub(crate) fn wait_for_bus(&mut self, address: u32, load: bool) {
        let cycles = self.estimate().peripheral(self.chip.apb_divider(address), load);
        self.spend(0, cycles);
    }

    /// Sets HCLK; the cycle counter keeps its value.
    pub(crate) fn set_clock(&mut self, hertz: u64) {
        let count = self.cyccnt();
        self.cycle = Time::of_cycle(hertz.max(1));
        self.systick.change_clock(self.now, self.cycle);
        self.due_is_new();
        self.set_cyccnt(self.cyccnt_runs(), count);
    }

    pub(crate) fn cyccnt(&self) -> u32 {
        let Cyccnt { at, value, runs } = self.cyccnt;
        if runs { value.wrapping_add((self.now.since(at).0 / self.cycle.0) as u32) } else { value }
    }

    pub(crate) fn cyccnt_runs(&self) -> bool {
        self.cyccnt.runs
    }

    pub(crate) fn set_cyccnt(&mut self, runs: bool, value: u32) {
        self.cyccnt = Cyccnt { at: self.now, value, runs };
    }
}
