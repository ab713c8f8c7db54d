//! Everything of a machine that the callbacks of the CPU library reach: the state around the CPU's registers.

use std::collections::VecDeque;
use std::rc::Rc;

use canbus::Time;
use chip::{BusFault, Effect, Peripherals};

use crate::clock::Clock;
use crate::costs::Costs;
use crate::dwt::Dwt;
use crate::exception::Exception;
use crate::fault::Fault;
use crate::incident::Incidents;
use crate::mechanism::{Mechanism, Missing};
use crate::memory::Memory;
use crate::model::Model;
use crate::nvic::Nvic;
use crate::scb::Scb;
use crate::stats::Stats;
use crate::systick::SysTick;

/// Cycles to refill the pipeline after a jump (Cortex-M4 TRM, section 3.3.1: one to three).
const REFILL: u32 = 2;

/// Why the CPU stopped in the middle of its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Something has to be looked at: time, an interrupt, an effect.
    Attention,
    /// WFI.
    WaitForInterrupt,
    /// WFE.
    WaitForEvent,
    /// A branch to this EXC_RETURN.
    Return(u32),
    /// SVC; PC is behind it.
    Supervisor,
    /// BKPT; PC is on it.
    Breakpoint,
    /// A load from flash while it is busy; PC is on it.
    FlashBusy,
    /// An instruction that could not be carried out; PC is on it.
    Fault(Fault),
}

/// What the block hook decides by, and what callbacks leave for the run loop.
pub(crate) struct Run {
    /// The next instant at which the run loop has something to do.
    pub(crate) due: Time,
    /// Where the run loop was told to stop.
    pub(crate) until: Time,
    /// The run loop must look as soon as the current block is through.
    pub(crate) attention: bool,
    /// Priority of the best pending exception, when only the mask registers hold it back.
    pub(crate) masked: Option<i16>,
    /// Flash is busy until then; code and data fetches from it wait.
    pub(crate) stalled: Option<Time>,
    /// Why the CPU stopped.
    pub(crate) cause: Option<Cause>,
    /// The end of the block that runs: the next block starts here unless there was a jump.
    pub(crate) block_end: u32,
    /// A LDREX may have opened the exclusive monitor.
    pub(crate) exclusive: bool,
    /// The event register of WFE.
    pub(crate) event: bool,
    /// A peripheral refused an access.
    pub(crate) refused: Option<u32>,
    /// The address of an access that reached nothing.
    pub(crate) missed: u32,
    pub(crate) effects: VecDeque<Effect>,
}

impl Run {
    pub(crate) fn new() -> Run {
        Run {
            due: Time::ZERO,
            until: Time::ZERO,
            attention: true,
            masked: None,
            stalled: None,
            cause: None,
            block_end: 0,
            exclusive: false,
            event: false,
            refused: None,
            missed: 0,
            effects: VecDeque::new(),
        }
    }
}

/// The state around the registers.
pub(crate) struct System<P> {
    pub(crate) model: Model,
    pub(crate) peripherals: P,
    pub(crate) memory: Rc<Memory>,
    pub(crate) clock: Clock,
    pub(crate) nvic: Nvic,
    pub(crate) scb: Scb,
    pub(crate) systick: SysTick,
    pub(crate) dwt: Dwt,
    pub(crate) costs: Costs,
    pub(crate) stats: Stats,
    pub(crate) incidents: Incidents,
    pub(crate) missing: Missing,
    pub(crate) run: Run,
}

impl<P: Peripherals> System<P> {
    pub(crate) fn new(model: Model, peripherals: P) -> System<P> {
        let clock = Clock::new(model.reset_clock);
        System {
            memory: Rc::new(Memory::new(&model)),
            nvic: Nvic::new(),
            scb: Scb::new(),
            systick: SysTick::new(clock.cycle()),
            dwt: Dwt::default(),
            costs: Costs::new(),
            stats: Stats::new(),
            incidents: Incidents::default(),
            missing: Missing::default(),
            run: Run::new(),
            clock,
            model,
            peripherals,
        }
    }

    /// The core's own registers after a reset.
    pub(crate) fn reset(&mut self) {
        self.clock.set_frequency(self.model.reset_clock);
        self.nvic = Nvic::new();
        self.scb = Scb::new();
        self.systick = SysTick::new(self.clock.cycle());
        self.dwt = Dwt::default();
        self.stats.reset(self.clock.now());
        self.run = Run { until: self.run.until, ..Run::new() };
    }

    pub(crate) fn works(&self, mechanism: Mechanism) -> bool {
        !self.missing.contains(mechanism)
    }

    /// Lets everything that is due by now happen, in its order, each at its own instant.
    pub(crate) fn catch_up(&mut self) {
        let now = self.clock.now();
        loop {
            let due = self.peripherals.deadline();
            let tick = self.systick_deadline();
            if due.min(tick) > now {
                break;
            }
            if tick < due { self.tick(tick) } else { self.advance(due) }
        }
    }

    /// Whether the block at `address` has to wait for the run loop.
    #[inline]
    pub(crate) fn must_stop(&self, address: u32) -> bool {
        self.run.attention || self.clock.now() >= self.run.due || self.waits_for_flash(address)
    }

    /// Whether an access to `address` waits because flash is busy.
    pub(crate) fn waits_for_flash(&self, address: u32) -> bool {
        self.run.stalled.is_some() && self.model.flash.contains(&self.flash_address(address))
    }

    /// The address in the flash array of an address that may be of its alias at 0.
    pub(crate) fn flash_address(&self, address: u32) -> u32 {
        if (address as usize) < self.model.flash_size() { address + self.model.flash.start } else { address }
    }

    /// Charges a block that is about to run.
    #[inline]
    pub(crate) fn charge(&mut self, address: u32, size: u32) -> Result<(), Fault> {
        let cost = self.costs.of(address, size, &self.memory).ok_or(Fault::Execute { address })?;
        if cost.float && !self.scb.fpu_enabled() {
            return Err(Fault::NoCoprocessor);
        }
        let cycles = cost.cycles + if address == self.run.block_end { 0 } else { REFILL };
        self.clock.run(cycles);
        self.stats.ran(cost.instructions, cycles);
        self.run.block_end = address + size;
        self.run.exclusive |= cost.exclusive;
        self.run.event |= cost.event;
        Ok(())
    }

    /// The core is busy with an exception entry or exit.
    pub(crate) fn spend(&mut self, cycles: u32) {
        self.clock.run(cycles);
        self.stats.ran(0, cycles);
    }

    fn advance(&mut self, due: Time) {
        self.peripherals.advance(due, &*self.memory);
        assert!(self.peripherals.deadline() > due, "a deadline at {due} that does not go away");
        self.look(due);
    }

    fn tick(&mut self, due: Time) {
        if self.systick.expire(due) {
            self.nvic.pend(Exception::SYS_TICK, due);
            self.run.attention = true;
        }
    }

    fn systick_deadline(&self) -> Time {
        if self.works(Mechanism::SysTick) { self.systick.deadline() } else { Time::NEVER }
    }

    /// Samples the interrupt lines and fetches effects after the chip was touched, and finds the next deadline.
    pub(crate) fn look(&mut self, at: Time) {
        let levels = self.works(Mechanism::Levels);
        self.nvic.sample(self.peripherals.lines().0, levels, at);
        while let Some(effect) = self.peripherals.effect() {
            self.run.effects.push_back(effect);
        }
        self.consider();
    }

    /// Decides whether the run loop has to look: something to take, or something to do. Exceptions that only the
    /// mask registers could hold back count, because those registers are read there.
    pub(crate) fn consider(&mut self) {
        let ready = self.nvic.best().filter(|best| self.preempts(best.priority, self.nvic.active_priority()));
        let news = ready.is_some_and(|best| self.run.masked.is_none_or(|masked| best.priority < masked));
        self.run.attention |= news || !self.run.effects.is_empty() || self.scb.reset_requested;
        self.run.due = self.next_event().min(self.run.until);
    }

    /// Whether an exception of `priority` is taken at execution priority `running`.
    pub(crate) fn preempts(&self, priority: i16, running: i16) -> bool {
        let nested = self.nvic.active_priority() < crate::nvic::THREAD_PRIORITY && priority >= 0;
        priority < running && (!nested || self.works(Mechanism::Preemption))
    }

    /// The next instant at which something happens without the core.
    pub(crate) fn next_event(&self) -> Time {
        let stall = self.run.stalled.unwrap_or(Time::NEVER);
        self.peripherals.deadline().min(self.systick_deadline()).min(stall)
    }

    /// A read that a program makes of a peripheral or the system control space. A refused one reads as zero and
    /// becomes a fault at the end of the block.
    pub(crate) fn read(&mut self, address: u32, size: u8) -> u32 {
        self.catch_up();
        let value = self.read_region(address, size).unwrap_or_else(|BusFault| self.refuse(address));
        self.look(self.clock.now());
        value
    }

    /// A write that a program makes.
    pub(crate) fn write(&mut self, address: u32, size: u8, value: u32) {
        self.catch_up();
        if self.write_region(address, size, value) == Err(BusFault) {
            self.refuse(address);
        }
        self.look(self.clock.now());
    }

    fn refuse(&mut self, address: u32) -> u32 {
        self.run.refused = Some(address);
        self.run.attention = true;
        0
    }

    fn read_region(&mut self, address: u32, size: u8) -> Result<u32, BusFault> {
        match address {
            0x2200_0000..=0x23FF_FFFF | 0x4200_0000..=0x43FF_FFFF => self.read_bit(address),
            0xE000_0000..=0xE003_FFFF => self.read_control(address, size),
            _ => self.peripherals.read(address, size, self.clock.now()),
        }
    }

    fn write_region(&mut self, address: u32, size: u8, value: u32) -> Result<(), BusFault> {
        match address {
            0x2200_0000..=0x23FF_FFFF | 0x4200_0000..=0x43FF_FFFF => self.write_bit(address, value),
            0xE000_0000..=0xE003_FFFF => self.write_control(address, size, value),
            _ => self.peripherals.write(address, size, value, self.clock.now()),
        }
    }

    /// A store into the flash array.
    pub(crate) fn program(&mut self, address: u32, value: &[u8]) {
        self.catch_up();
        let mut old = [0; 8];
        let old = &mut old[..value.len()];
        let result = self.memory.load(address, old);
        let result = result.and_then(|()| self.peripherals.program(address, old, value, self.clock.now()));
        if result == Err(BusFault) {
            self.refuse(address);
        }
        self.look(self.clock.now());
    }
}
