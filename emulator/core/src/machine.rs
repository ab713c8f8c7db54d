//! The machine: a core with its memory and a chip around it, run in virtual time.

mod debugger;

use canbus::Time;
use chip::{Breach, Effect, Peripherals};
use unicorn_engine::{RegisterARM, UcHookId, uc_error};

use crate::alignment;
use crate::clock;
use crate::context::THUMB;
use crate::core::{Core, Halt};
use crate::engine::{self, Cpu, NOWHERE};
use crate::estimate::Estimate;
use crate::exception::Exception;
use crate::fault::Fault;
use crate::incident::Incident;
use crate::mechanism::Mechanism;
use crate::model::{Error, Model};
use crate::power_up::PowerUp;
use crate::profile::Visits;
use crate::scb::{SLEEPDEEP, cfsr};
use crate::stats::Stats;
use crate::stepping::{self, Stepping};

/// The reason why [`Machine::run_until`] returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The time is reached.
    Reached,
    /// The chip has a change that the bus must see.
    Poked,
    /// A fault inside of a fault: the core stops until a reset.
    Lockup {
        /// The program counter.
        pc: u32,
    },
    /// The supply failed, as a test requested.
    PowerCut,
    /// A watched point of [`Machine::watch`] is reached.
    Watched,
    /// The chip was reset, and nothing has run since: see [`Machine::stop_at_resets`].
    Reset,
}

/// A core, its memory, and a chip.
pub struct Machine<P: Peripherals + 'static> {
    pub(crate) cpu: Cpu<P>,
    model: Model,
    power_up: PowerUp,
    powered: bool,
    power_ons: u64,
    sleeping: bool,
    /// The pending exceptions with which the core last slept on.
    resting: Option<u128>,
    locked: Option<u32>,
    stall: Time,
    /// The core has left the Thumb state by a vector.
    pub(crate) lost_thumb: bool,
    /// A load waits for flash; the core does nothing else until the load ends.
    loading: bool,
    incidents: Vec<(Time, Incident)>,
    /// The hook of [`Machine::watch`].
    pub(crate) watching: Option<UcHookId>,
    /// The program has stopped at a watched point.
    at_point: bool,
    /// [`Machine::run_until`] returns after a reset.
    stops_at_resets: bool,
    /// The chip was reset since the last look.
    was_reset: bool,
    /// Output of the program by semihosting; `None` without a debugger.
    pub(crate) printed: Option<Vec<u8>>,
}

impl<P: Peripherals + 'static> Machine<P> {
    /// A machine without power and with erased flash.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn new(model: Model, peripherals: P) -> Result<Machine<P>, Error> {
        let mut cpu = engine::new(&model, Core::new(peripherals, &model))?;
        engine::store(&mut cpu, model.flash.start, &vec![0xFF; model.flash.len()])?;
        Ok(Machine {
            cpu,
            model,
            power_up: PowerUp::new(0),
            powered: false,
            power_ons: 0,
            sleeping: false,
            resting: None,
            locked: None,
            stall: Time::ZERO,
            lost_thumb: false,
            loading: false,
            incidents: vec![],
            watching: None,
            at_point: false,
            stops_at_resets: false,
            was_reset: false,
            printed: None,
        })
    }

    /// Sets the seed of the RAM content at power-on: machines with different seeds differ. Must be called before
    /// power-on.
    pub fn set_power_up(&mut self, seed: u64) {
        self.power_up = PowerUp::new(seed);
    }

    /// The content of RAM at the last power-on. A byte with another value has been written since.
    pub fn ram_at_power_on(&self) -> &[u8] {
        self.power_up.content()
    }

    /// Switches the supply on at an instant.
    pub fn power_on(&mut self, at: Time) {
        let content = self.power_up.come(self.model.ram.len());
        let _ = engine::store(&mut self.cpu, self.model.ram.start, content);
        let core = self.cpu.get_data_mut();
        core.now = core.now.max(at);
        core.chip.reset(true, core.now);
        self.powered = true;
        self.power_ons += 1;
        self.restart();
    }

    /// How often the supply was switched on.
    pub fn power_ons(&self) -> u64 {
        self.power_ons
    }

    /// Whether the supply is on.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// Switches the supply off: RAM loses its content, flash keeps it.
    pub fn power_off(&mut self) {
        self.powered = false;
    }

    /// Virtual time.
    pub fn now(&self) -> Time {
        self.cpu.get_data().now
    }

    /// The chip.
    pub fn peripherals(&self) -> &P {
        &self.cpu.get_data().chip
    }

    /// The chip.
    pub fn peripherals_mut(&mut self) -> &mut P {
        &mut self.cpu.get_data_mut().chip
    }

    /// The counters.
    pub fn stats(&self) -> &Stats {
        &self.cpu.get_data().stats
    }

    /// Resets the worst activation and latency of every exception, to measure a later part of the run alone.
    pub fn forget_worst(&mut self) {
        self.cpu.get_data_mut().stats.forget_worst();
    }

    /// Lets interrupts come between any two instructions and advances time with each instruction, from now on, also
    /// after resets, and stores arrive at peripherals some cycles later. With a seed some instructions take a few cycles longer, so that each seed gives another
    /// interleaving. The mode is several times slower than the usual mode, which checks between blocks of code only.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn interleave(&mut self, seed: Option<u64>) -> Result<(), Error> {
        let fresh = self.cpu.get_data_mut().stepping.replace(Stepping::new(seed)).is_none();
        if fresh { engine::step_instructions(&mut self.cpu) } else { Ok(()) }
    }

    /// Sets the end of the published cycle ranges to count, from now on. [`Estimate::Worst`] also models the caches of
    /// the flash, and is several times slower.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn set_estimate(&mut self, estimate: Estimate) -> Result<(), Error> {
        let core = self.cpu.get_data_mut();
        let watches = core.accelerator.is_some();
        core.set_estimate(estimate);
        let begins = core.accelerator.is_some() && !watches;
        if begins { engine::watch_constants(&mut self.cpu, &self.model) } else { Ok(()) }
    }

    /// Pends an exception before the next execution of the instruction at this address. Has no effect unless
    /// [`Machine::interleave`] was called.
    pub fn interrupt_before(&mut self, address: u32, exception: Exception) {
        if let Some(stepping) = &mut self.cpu.get_data_mut().stepping {
            stepping.interrupt_before(address, exception);
        }
    }

    /// Takes the barrier (DSB or DMB) at an address out: it waits for no store. Has no effect unless
    /// [`Machine::interleave`] was called.
    pub fn omit_barrier(&mut self, address: u32) {
        if let Some(stepping) = &mut self.cpu.get_data_mut().stepping {
            stepping.omit(address);
        }
    }

    /// Starts or stops counting how often each block of code runs.
    pub fn set_profiling(&mut self, on: bool) {
        self.cpu.get_data_mut().profile.is_on = on;
    }

    /// The counts of each block, by address; resets the counts.
    pub fn take_profile(&mut self) -> Vec<Visits> {
        self.cpu.get_data_mut().profile.take()
    }

    /// Faults, resets and broken rules since power-on of the machine, with their instants.
    pub fn incidents(&self) -> &[(Time, Incident)] {
        &self.incidents
    }

    /// The memory of the chip.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Switches one mechanism off, for the negative control of a test.
    pub fn without(&mut self, mechanism: Mechanism) {
        self.cpu.get_data_mut().without = Some(mechanism);
    }

    /// The next instant at which the state changes without an outside event: now, unless the core sleeps.
    pub fn next_event(&self) -> Time {
        let core = self.cpu.get_data();
        match (self.powered, self.rests()) {
            (false, _) => Time::NEVER,
            (true, true) => core.deadline().max(core.now),
            (true, false) => core.now,
        }
    }

    /// Has the machine look at everything again before it sleeps on, after a change that no other method has made.
    pub fn stir(&mut self) {
        self.resting = None;
    }

    /// Whether the core sleeps, and nothing has come that could wake it.
    fn rests(&self) -> bool {
        let core = self.cpu.get_data();
        self.resting.is_some_and(|pending| core.is_as_it_slept(pending))
    }

    /// Lets a resting core sleep on; `false` when the core or the chip has something to do until then.
    fn sleeps_on(&mut self, until: Time) -> bool {
        let sleeps_on = self.powered && until < self.next_event() && self.rests();
        if sleeps_on {
            self.sleep_to(until);
        }
        sleeps_on
    }

    /// Runs to `until`, or until an earlier reason to stop.
    pub fn run_until(&mut self, until: Time) -> Stop {
        self.cpu.get_data_mut().until = until;
        if self.sleeps_on(until) {
            return self.reached();
        }
        loop {
            if !self.powered {
                let core = self.cpu.get_data_mut();
                core.now = core.now.max(until);
                return Stop::Reached;
            }
            if let Some(stop) = self.attend() {
                return stop;
            }
            if self.is_at_reset() {
                return Stop::Reset;
            }
            if self.now() >= until {
                return self.reached();
            }
            self.step(until);
            if std::mem::take(&mut self.at_point) {
                return Stop::Watched;
            }
        }
    }

    fn reached(&self) -> Stop {
        self.locked.map_or(Stop::Reached, |pc| Stop::Lockup { pc })
    }

    /// Has [`Machine::run_until`] come back after each reset, before the first instruction, from now on or no longer.
    pub fn stop_at_resets(&mut self, on: bool) {
        self.stops_at_resets = on;
        self.was_reset = false;
    }

    /// After a reset whose effects on memory are over.
    fn is_at_reset(&mut self) -> bool {
        let is_over = self.cpu.get_data().effects.is_empty();
        self.stops_at_resets && is_over && std::mem::take(&mut self.was_reset)
    }

    /// The machine's own part of a [`crate::Moment`].
    pub(crate) fn state(&self) -> (bool, Option<u32>, Time, bool) {
        (self.sleeping, self.locked, self.stall, self.loading)
    }

    pub(crate) fn set_state(&mut self, state: (bool, Option<u32>, Time, bool)) {
        (self.sleeping, self.locked, self.stall, self.loading) = state;
        self.resting = None;
        self.was_reset = false;
        self.powered = true;
    }

    /// Processes everything that is due before the next block: events, effects, resets.
    fn attend(&mut self) -> Option<Stop> {
        self.advance_chip();
        while let Some((at, pc, rule)) = self.cpu.get_data_mut().breaches.pop_front() {
            self.incidents.push((at, Incident::Breach { rule, pc }));
        }
        while let Some(effect) = self.cpu.get_data_mut().effects.pop_front() {
            if let Some(stop) = self.carry_out(effect) {
                return Some(stop);
            }
        }
        if std::mem::take(&mut self.cpu.get_data_mut().reset_requested) {
            self.reset(Incident::SoftwareReset);
        }
        None
    }

    fn advance_chip(&mut self) {
        self.cpu.get_data_mut().advance();
    }

    fn carry_out(&mut self, effect: Effect) -> Option<Stop> {
        match engine::apply(&mut self.cpu, effect) {
            Ok(Some(Effect::StallFlash(end))) => self.stall = self.stall.max(end),
            Ok(Some(Effect::CoreClock(hertz))) => self.cpu.get_data_mut().set_clock(hertz),
            Ok(Some(Effect::Reset)) => self.reset(Incident::ChipReset),
            Ok(Some(Effect::Poke)) => return Some(Stop::Poked),
            Ok(Some(Effect::PowerCut)) => {
                self.power_off();
                return Some(Stop::PowerCut);
            }
            // The chip checked the address when it requested the effect. An effect outside of memory is lost, as on a
            // real bus.
            Ok(_) | Err(_) => {}
        }
        None
    }

    /// One step of the core: an exception, a sleep, or code.
    fn step(&mut self, until: Time) {
        let masks = clock::masks(&self.cpu);
        self.resting = None;
        if self.loading && self.now() < self.stall {
            return self.wait_for_flash(until);
        }
        self.loading = false;
        if self.locked.is_some() {
            return self.idle(until);
        }
        if let Some(address) = self.cpu.get_data_mut().lost_store.take() {
            self.sleeping = false;
            return self.take_fault(Fault::lost_store(self.pc(), address));
        }
        let core = self.cpu.get_data();
        if self.sleeping {
            if !core.nvic.wakes(masks) && !core.lacks(Mechanism::Sleep) {
                return self.idle(until);
            }
            self.sleeping = false;
        }
        if let Some(exception) = core.to_take(masks) {
            return self.enter(exception);
        }
        if self.stalls() {
            return self.wait_for_flash(until);
        }
        if std::mem::take(&mut self.lost_thumb) {
            return self.take_fault(Fault::usage(self.pc(), cfsr::INVSTATE));
        }
        self.run_code();
    }

    fn stalls(&self) -> bool {
        self.now() < self.stall && self.model.flash.contains(&self.pc())
    }

    /// Lets the core wait for the flash, at most until the next event of the chip.
    fn wait_for_flash(&mut self, until: Time) {
        let next = self.cpu.get_data().deadline().min(until);
        self.pass_to(self.stall.min(next));
    }

    /// Lets the core sleep until the next event.
    fn idle(&mut self, until: Time) {
        self.resting = Some(self.cpu.get_data().nvic.pending_set());
        let next = self.cpu.get_data().deadline().min(until);
        self.sleep_to(next);
    }

    fn sleep_to(&mut self, instant: Time) {
        let before = self.now();
        self.pass_to(instant);
        let core = self.cpu.get_data_mut();
        core.stats.asleep += core.now - before;
    }

    fn pass_to(&mut self, instant: Time) {
        let core = self.cpu.get_data_mut();
        core.now = core.now.max(instant);
    }

    fn run_code(&mut self) {
        let closed = self.now() < self.stall && !self.cpu.get_data().lacks(Mechanism::FlashLoads);
        engine::close_flash(&mut self.cpu, &self.model, closed);
        let pc = self.pc();
        engine::forget_code_in_ram(&mut self.cpu, pc);
        engine::follow_protection(&mut self.cpu);
        let core = self.cpu.get_data_mut();
        core.halt = None;
        core.look_again();
        core.unmapped = None;
        core.denied = None;
        let result = self.cpu.emu_start(u64::from(self.pc() | 1), NOWHERE, 0, 0);
        match (result, self.cpu.get_data_mut().halt.take()) {
            (_, Some(Halt::Attention)) => {}
            (_, Some(Halt::Watched)) => self.at_point = true,
            (_, Some(Halt::ExceptionReturn)) => self.leave(),
            (_, Some(Halt::SupervisorCall)) => self.supervisor_call(),
            (_, Some(Halt::Breakpoint)) => {
                if !self.answer_call() {
                    self.take_fault(Fault::breakpoint(self.pc()));
                }
            }
            (_, Some(Halt::Undefined)) => self.take_fault(Fault::undefined(self.pc())),
            (_, Some(Halt::Usage(status))) => self.take_fault(Fault::usage(self.pc(), status)),
            (_, Some(Halt::DataFault(address))) => self.take_fault(Fault::data(self.pc(), address)),
            (Err(uc_error::READ_PROT), None) if self.cpu.get_data().flash_closed => self.loading = true,
            (Err(error), None) => self.refused(error),
            (Ok(()), None) => {
                self.sleeping = true;
                // WFI has two bytes.
                let address = self.pc().wrapping_sub(2);
                let core = self.cpu.get_data_mut();
                core.chip.slept(address);
                if core.scb.scr & SLEEPDEEP != 0 {
                    core.report(Breach::NotModelled { what: "WFI with SLEEPDEEP, which stops the clocks," });
                }
            }
        }
    }

    /// The library has refused an access. A buffered store is complete for the program, which continues; any other
    /// access is a fault.
    fn refused(&mut self, error: uc_error) {
        let core = self.cpu.get_data();
        let store = core.unmapped.filter(|access| access.store && core.scb.buffers(access.address));
        let Some(store) = store else { return self.take_fault(self.fault_of(error)) };
        let (pc, mut code) = (self.pc(), [0; 2]);
        let _ = self.read(pc, &mut code);
        self.set(RegisterARM::PC, pc + stepping::width(u16::from_le_bytes(code)));
        self.cpu.get_data_mut().lost_store = Some(store.address);
    }

    fn fault_of(&self, error: uc_error) -> Fault {
        let pc = self.pc();
        if let Some(page) = self.cpu.get_data().denied {
            return Fault::protection(pc, self.accessed(page));
        }
        match self.cpu.get_data().unmapped {
            Some(access) if access.fetch => Fault::fetch(pc),
            Some(access) => Fault::data(pc, access.address),
            None if !self.cpu.get_data().scb.mpu.allows_code(pc) => Fault::execution(pc),
            None if matches!(error, uc_error::FETCH_PROT | uc_error::FETCH_UNMAPPED) => Fault::fetch(pc),
            None if self.register(RegisterARM::XPSR) & THUMB == 0 => Fault::usage(pc, cfsr::INVSTATE),
            None => Fault::undefined(pc),
        }
    }

    /// The address of the access to a page by the current instruction, as far as it can be told.
    fn accessed(&self, page: u32) -> u32 {
        let mut code = [0; stepping::LONGEST_BLOCK];
        let _ = self.read(self.pc(), &mut code);
        let address = alignment::accessed(&code, |number| engine::core_register(&self.cpu, number));
        address.filter(|address| address >> 10 == page >> 10).unwrap_or(page)
    }

    /// Takes an SVC. An SVC that cannot be taken at once becomes a HardFault (ARMv7-M, B1.5.2).
    fn supervisor_call(&mut self) {
        let masks = clock::masks(&self.cpu);
        let core = self.cpu.get_data_mut();
        if core.nvic.may_preempt(Exception::SV_CALL, masks) {
            core.pend(Exception::SV_CALL);
        } else {
            self.take_fault(Fault::refused_call(self.pc()));
        }
    }

    pub(crate) fn note(&mut self, incident: Incident) {
        let now = self.now();
        self.incidents.push((now, incident));
    }

    pub(crate) fn lock_up(&mut self, pc: u32) {
        self.locked = Some(pc);
    }

    fn reset(&mut self, incident: Incident) {
        self.note(incident);
        self.was_reset = true;
        let core = self.cpu.get_data_mut();
        core.chip.reset(false, core.now);
        self.restart();
    }

    /// Starts the core after any reset: stack pointer and program counter from the start of flash.
    fn restart(&mut self) {
        self.cpu.get_data_mut().reset();
        self.cpu.get_data_mut().memory.protection_is_new = true;
        self.cpu.get_data_mut().memory.code_is_old = true;
        self.sleeping = false;
        self.resting = None;
        self.locked = None;
        self.stall = Time::ZERO;
        self.loading = false;
        let vectors = self.model.flash.start;
        let (stack, entry) = (self.word(vectors).unwrap_or(0), self.word(vectors + 4).unwrap_or(0));
        self.reset_registers(stack, entry);
        self.cpu.get_data_mut().settle();
    }

    pub(crate) fn word(&self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.cpu.get_data().memory.read(address, &mut bytes)?;
        Some(u32::from_le_bytes(bytes))
    }

    pub(crate) fn register(&self, register: RegisterARM) -> u32 {
        self.cpu.reg_read(register).unwrap_or(0) as u32
    }

    pub(crate) fn set(&mut self, register: RegisterARM, value: u32) {
        let _ = self.cpu.reg_write(register, value.into());
    }

    /// The program counter.
    pub fn pc(&self) -> u32 {
        self.register(RegisterARM::PC) & !1
    }
}
