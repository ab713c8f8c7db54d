//! The state that the hooks of the CPU library share with the run loop: clock, interrupt controller, system
//! registers, and the chip behind them.

use std::collections::VecDeque;

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
use crate::profile::Profile;
use crate::scb::Scb;
use crate::seed::Bugs;
use crate::stats::Stats;
use crate::stepping::Stepping;
use crate::systick::SysTick;
use crate::watch::Watch;

/// Why the CPU library was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halt {
    /// Something is due: time, an effect, an interrupt.
    Attention,
    /// A point that is watched for.
    Watched,
    /// The core branched to an EXC_RETURN value.
    ExceptionReturn,
    /// SVC; the address after it.
    SupervisorCall,
    /// BKPT.
    Breakpoint,
    /// An exception of the CPU library's own, such as an access that it forbids.
    Undefined,
    /// A usage fault with this status, seen before the instruction runs.
    Usage(u32),
    /// A data access that nothing answers, seen by the chip or by the system space.
    DataFault(u32),
}

/// An access to memory that is not mapped, as the hook saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unmapped {
    pub(crate) address: u32,
    pub(crate) fetch: bool,
    pub(crate) store: bool,
}

/// Everything but the registers and the memory.
pub(crate) struct Core<P> {
    pub(crate) chip: P,
    pub(crate) memory: Bytes,
    pub(crate) now: Time,
    /// Length of a core cycle.
    pub(crate) cycle: Time,
    /// The run loop wants control back here.
    pub(crate) until: Time,
    /// When the chip or SysTick wants to be advanced; kept, because it is asked for before every block.
    due: Time,
    /// Only time can stop the program before its next block, at the earliest at `bound`; kept for the same reason.
    calm: bool,
    bound: Time,
    pub(crate) nvic: Nvic,
    pub(crate) scb: Scb,
    pub(crate) systick: SysTick,
    pub(crate) stats: Stats,
    pub(crate) profile: Profile,
    /// Interrupts come between any two instructions.
    pub(crate) stepping: Option<Stepping>,
    /// What the program does wrong for a test.
    pub(crate) bugs: Bugs,
    /// Points before which the program stops.
    pub(crate) watch: Option<Watch>,
    pub(crate) halt: Option<Halt>,
    pub(crate) unmapped: Option<Unmapped>,
    /// A store that was not waited for has found nothing, at this address: the fault is taken before the next block.
    pub(crate) lost_store: Option<u32>,
    /// Rules that were found broken: when, and where the program was.
    pub(crate) breaches: VecDeque<(Time, u32, Breach)>,
    /// The code that was charged last.
    pub(crate) place: u32,
    pub(crate) effects: VecDeque<Effect>,
    /// When an exception became pending, for its latency.
    pub(crate) pended: [Time; Exception::COUNT],
    pub(crate) costs: Costs,
    /// The caches of the flash, where their misses are counted.
    pub(crate) accelerator: Option<Accelerator>,
    /// Where the program goes on if it does not jump.
    pub(crate) ahead: u32,
    pub(crate) reset_requested: bool,
    /// The program has written BASEPRI.
    pub(crate) wrote_basepri: bool,
    /// The program has begun an exclusive access since the monitor was cleared.
    pub(crate) exclusive: bool,
    /// The emulator itself runs code, not the program.
    pub(crate) clearing_monitor: bool,
    pub(crate) without: Option<Mechanism>,
    /// Flash is busy, and what runs does not come from it: loads from there are to be noticed.
    pub(crate) flash_closed: bool,
    /// How often the flash array was written.
    pub(crate) flash_changes: u64,
    cyccnt: Option<Cyccnt>,
}

/// The part of a [`crate::Moment`] that is here.
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
    cyccnt: Option<Cyccnt>,
    ahead: u32,
}

/// DWT_CYCCNT: its value at some instant, and it runs from there.
#[derive(Clone, Copy, Debug)]
struct Cyccnt {
    at: Time,
    value: u32,
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
            bugs: Bugs::default(),
            watch: None,
            halt: None,
            unmapped: None,
            lost_store: None,
            breaches: VecDeque::new(),
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
            cyccnt: None,
        }
    }

    /// What a program can see, and the time.
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
        }
    }

    /// Back to that moment.
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
        self.halt = None;
        self.unmapped = None;
        self.lost_store = None;
    }

    /// Back to the state after a reset; the clock of virtual time and the counters go on.
    pub(crate) fn reset(&mut self) {
        self.nvic = Nvic::default();
        self.scb = Scb::default();
        self.systick = SysTick::default();
        self.stats.unwound();
        self.halt = None;
        self.unmapped = None;
        self.lost_store = None;
        self.reset_requested = false;
        self.cyccnt = None;
        self.cycle = Time::of_cycle(16_000_000);
        self.accelerator.iter_mut().for_each(Accelerator::clear);
    }

    /// Which end of the published ranges cycles are counted by, from now on.
    pub(crate) fn set_estimate(&mut self, estimate: Estimate) {
        self.costs = Costs::new(estimate);
        self.accelerator = (estimate == Estimate::Worst).then(Accelerator::new);
    }

    pub(crate) fn estimate(&self) -> Estimate {
        self.costs.estimate
    }

    /// The exception to take now, if one may preempt.
    pub(crate) fn to_take(&self, masks: Masks) -> Option<Exception> {
        let nested = self.nvic.any_active();
        self.nvic.to_take(masks).filter(|_| !(nested && self.lacks(Mechanism::Preemption)))
    }

    pub(crate) fn lacks(&self, mechanism: Mechanism) -> bool {
        self.without == Some(mechanism)
    }

    /// The next instant at which something happens by itself.
    pub(crate) fn deadline(&self) -> Time {
        self.chip.deadline().min(self.systick.deadline())
    }

    /// Whether the run loop has something to do before the next block runs.
    pub(crate) fn needs_attention(&self) -> bool {
        self.now >= self.until.min(self.due)
            || self.reset_requested
            || !self.effects.is_empty()
            || self.lost_store.is_some()
    }

    /// Whether the next block runs without a further look. Where this says no, that block may run all the same.
    #[inline]
    pub(crate) fn is_undisturbed(&self) -> bool {
        self.calm && self.now < self.bound
    }

    /// After a change of what may stop the program, and before the program goes on.
    pub(crate) fn look_again(&mut self) {
        self.bound = self.until.min(self.due);
        self.calm = self.halt.is_none()
            && self.lost_store.is_none()
            && self.effects.is_empty()
            && !self.reset_requested
            && !self.flash_closed
            && !self.nvic.could_preempt();
    }

    /// Has the run loop take over before the next block.
    pub(crate) fn stop_for(&mut self, halt: Halt) {
        self.halt = Some(halt);
        self.calm = false;
    }

    /// Lets everything due happen, and samples the interrupt lines.
    pub(crate) fn advance(&mut self) {
        if self.chip.deadline() <= self.now {
            self.chip.advance(self.now, &self.memory);
        }
        if self.systick.advance(self.now) {
            self.pend(Exception::SYS_TICK);
        }
        self.settle();
    }

    /// Takes over what a call into the chip changed.
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
        self.due = self.deadline();
        self.look_again();
    }

    /// A rule is broken, here and now.
    pub(crate) fn report(&mut self, breach: Breach) {
        self.breaches.push_back((self.now, self.place, breach));
    }

    pub(crate) fn pend(&mut self, exception: Exception) {
        if !self.nvic.is_pending(exception) {
            self.pended[usize::from(exception.0)] = self.now;
        }
        self.nvic.pend(exception);
        self.calm = false;
    }

    /// Remembers when these exceptions became pending.
    pub(crate) fn stamp(&mut self, mut fresh: u128) {
        while fresh != 0 {
            self.pended[fresh.trailing_zeros() as usize] = self.now;
            fresh &= fresh - 1;
        }
    }

    pub(crate) fn spend(&mut self, instructions: u32, cycles: u32) {
        self.now += Time(self.cycle.0 * u64::from(cycles));
        self.stats.ran(instructions, cycles);
    }

    /// Code at these addresses is about to run: what fills the pipeline if the program has jumped there, and waits for the flash.
    #[inline]
    pub(crate) fn fetch_cycles(&mut self, address: u32, size: u32) -> u32 {
        let in_a_row = std::mem::replace(&mut self.ahead, address + size) == address;
        let refill = if in_a_row { 0 } else { self.estimate().refill() };
        refill + self.flash_cycles(address, size, in_a_row)
    }

    /// What the flash lets the core wait for code.
    #[inline]
    fn flash_cycles(&mut self, address: u32, size: u32, in_a_row: bool) -> u32 {
        match &mut self.accelerator {
            Some(accelerator) if address < RAM => {
                accelerator.fetch(address, size, in_a_row, self.chip.flash_access())
            }
            _ => 0,
        }
    }

    /// A constant is read from flash.
    pub(crate) fn wait_for_constant(&mut self, address: u32) {
        if let Some(accelerator) = &mut self.accelerator {
            let cycles = accelerator.load(address, self.chip.flash_access());
            self.spend(0, cycles);
        }
    }

    /// An entry of the vector table is read, as code is.
    pub(crate) fn wait_for_vector(&mut self, address: u32) {
        let cycles = self.flash_cycles(address, 4, false);
        self.spend(0, cycles);
    }

    /// A register of the chip is accessed.
    pub(crate) fn wait_for_bus(&mut self, address: u32, load: bool) {
        let cycles = self.estimate().peripheral(self.chip.apb_divider(address), load);
        self.spend(0, cycles);
    }

    /// HCLK is now `hertz`; the cycle counter goes on from where it is.
    pub(crate) fn set_clock(&mut self, hertz: u64) {
        let count = self.cyccnt();
        self.cycle = Time::of_cycle(hertz.max(1));
        self.systick.change_clock(self.now, self.cycle);
        self.due = self.deadline();
        self.look_again();
        self.set_cyccnt(self.cyccnt_runs(), count);
    }

    pub(crate) fn cyccnt(&self) -> u32 {
        self.cyccnt
            .map_or(0, |count| count.value.wrapping_add((self.now.since(count.at).0 / self.cycle.0) as u32))
    }

    pub(crate) fn cyccnt_runs(&self) -> bool {
        self.cyccnt.is_some()
    }

    pub(crate) fn set_cyccnt(&mut self, runs: bool, value: u32) {
        self.cyccnt = runs.then_some(Cyccnt { at: self.now, value });
    }
}
