//! The machine: power, time, and the loop that runs the core between events.

use std::ops::Range;

use canbus::Time;
use chip::{BusFault, Effect, Peripherals};
use unicorn_engine::RegisterARM;

use crate::core::Core;
use crate::error::Error;
use crate::exceptions::Lockup;
use crate::fault::Fault;
use crate::incident::Incident;
use crate::loader::{self, Image};
use crate::mechanism::Mechanism;
use crate::model::Model;
use crate::registers::Registers;
use crate::stats::Stats;
use crate::system::Cause;

/// The value of every byte of RAM after power-on: what still has it was never written.
pub const RAM_PATTERN: u8 = 0xA5;

/// Why [`Machine::run_until`] came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The instant is reached.
    Reached,
    /// The chip asks that the world look at the bus before the core runs on.
    Poked,
    /// A fault where none can be handled. The core stands; time passes for its peripherals, and a watchdog may
    /// still reset it.
    Lockup {
        /// Where it happened.
        pc: u32,
    },
    /// The chip says that power is gone: the machine is off.
    PowerCut,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Off,
    Running,
    /// In WFI, or in WFE when `event` ends it.
    Sleeping {
        event: bool,
    },
    /// A load waits for flash.
    Waiting,
    LockedUp,
}

/// A Cortex-M4 with memory and the peripherals of its chip.
pub struct Machine<P: Peripherals + 'static> {
    core: Core<P>,
    state: State,
}

impl<P: Peripherals + 'static> Machine<P> {
    /// A machine that is off, with erased flash.
    ///
    /// # Errors
    /// When the CPU library refuses the model's memory map.
    pub fn new(model: Model, peripherals: P) -> Result<Machine<P>, Error> {
        let core = Core::new(model, peripherals)?;
        let machine = Machine { core, state: State::Off };
        // The whole array is a range of itself.
        let _ = machine.core.system().memory.fill(&machine.model().flash, 0xFF);
        Ok(machine)
    }

    /// Writes the segments of an ELF file into flash by their load addresses.
    ///
    /// # Errors
    /// When it is not an ELF file for ARM, or not all of it lies in flash; then flash is unchanged.
    pub fn load_elf(&mut self, bytes: &[u8]) -> Result<Image, Error> {
        let image = loader::parse(bytes, self.model())?;
        for segment in &image.segments {
            self.store(segment.address, &segment.bytes);
        }
        Ok(image)
    }

    /// The contents of the flash array.
    pub fn flash(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.model().flash_size()];
        // The array is as long as itself.
        let _ = self.read(self.model().flash.start, &mut bytes);
        bytes
    }

    /// Replaces the flash array from its start; what lies behind `bytes` keeps its contents.
    ///
    /// # Errors
    /// When `bytes` is longer than the array.
    pub fn set_flash(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let start = self.model().flash.start;
        self.write(start, bytes).map_err(|BusFault| Error::FlashSize(bytes.len()))
    }

    /// Switches the supply on: RAM holds [`RAM_PATTERN`], the chip and the core come out of reset at `at`, or now if that is later.
    pub fn power_on(&mut self, at: Time) {
        let system = self.core.system_mut();
        system.clock.wait_until(at);
        self.fill(self.model().ram.clone(), RAM_PATTERN);
        self.reset(true);
    }

    /// Switches the supply off: RAM is lost, flash stays.
    pub fn power_off(&mut self) {
        self.state = State::Off;
    }

    /// Whether the machine has power.
    pub fn is_on(&self) -> bool {
        self.state != State::Off
    }

    /// The instant that the machine has reached.
    pub fn now(&self) -> Time {
        self.core.system().clock.now()
    }

    /// The chip around the core.
    pub fn peripherals(&self) -> &P {
        &self.core.system().peripherals
    }

    /// The chip around the core; changes are seen when the machine runs on.
    pub fn peripherals_mut(&mut self) -> &mut P {
        &mut self.core.system_mut().peripherals
    }

    /// Reads flash or RAM.
    ///
    /// # Errors
    /// When not all of the range is memory.
    pub fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        self.core.system().memory.load(address, bytes)
    }

    /// Writes RAM, or the flash array past its controller.
    ///
    /// # Errors
    /// When not all of the range is memory; then nothing is written.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), BusFault> {
        self.core.system().memory.store(address, bytes)?;
        self.changed(address..address + bytes.len() as u32);
        Ok(())
    }

    /// What ran, how often and how late.
    pub fn stats(&self) -> &Stats {
        &self.core.system().stats
    }

    /// Starts the figures of [`Machine::stats`] anew.
    pub fn clear_stats(&mut self) {
        let now = self.now();
        self.core.system_mut().stats.clear(now);
    }

    /// Faults and resets since the machine was made with their instants, the first 1000.
    pub fn incidents(&self) -> &[(Time, Incident)] {
        self.core.system().incidents.all()
    }

    /// A hash of all exception entries with their times and return addresses: equal for equal runs.
    pub fn trace_hash(&self) -> u64 {
        self.stats().trace()
    }

    /// The most bytes that a stack used since power-on: from the lowest byte of `stack` that no longer has the
    /// pattern of power-on to its end.
    pub fn stack_depth(&self, stack: Range<u32>) -> u32 {
        let mut bytes = vec![RAM_PATTERN; stack.len()];
        if self.read(stack.start, &mut bytes).is_err() {
            return 0;
        }
        let untouched = bytes.iter().take_while(|&&byte| byte == RAM_PATTERN).count();
        (bytes.len() - untouched) as u32
    }

    /// PC, for messages.
    pub fn pc(&self) -> u32 {
        self.core.uc.get(RegisterARM::PC)
    }

    /// Switches one mechanism off for good, for the negative control of a test.
    pub fn without(&mut self, mechanism: Mechanism) {
        self.core.system_mut().missing.add(mechanism);
    }

    /// The next instant at which something happens here when the outside does nothing: now, unless the core sleeps.
    pub fn next_event(&self) -> Time {
        match self.state {
            State::Off => Time::NEVER,
            State::Running => self.now(),
            _ => self.core.system().next_event().max(self.now()),
        }
    }

    /// The memories of the chip.
    pub fn model(&self) -> &Model {
        &self.core.system().model
    }

    /// Runs until an instant, or until there is news. The machine stops between instructions, so it may be past
    /// `until` by a basic block or an exception entry.
    pub fn run_until(&mut self, until: Time) -> Stop {
        self.core.system_mut().run.until = until;
        loop {
            if let Some(stop) = self.settle() {
                return stop;
            }
            if self.now() >= until {
                return Stop::Reached;
            }
            if let Some(stop) = self.go_on() {
                return stop;
            }
        }
    }

    /// One run of the core, or one wait.
    fn go_on(&mut self) -> Option<Stop> {
        let stalled = self.core.system().waits_for_flash(self.pc());
        match self.state {
            State::Running if !stalled => {
                let cause = self.core.execute();
                self.handle(cause)
            }
            State::Off => {
                let system = self.core.system_mut();
                system.clock.wait_until(system.run.until);
                None
            }
            _ => {
                self.wait();
                None
            }
        }
    }

    /// Lets time pass until something happens.
    fn wait(&mut self) {
        let system = self.core.system_mut();
        let waited = system.clock.wait_until(system.run.due);
        if matches!(self.state, State::Sleeping { .. }) {
            system.stats.slept(waited);
        }
    }

    fn handle(&mut self, cause: Cause) -> Option<Stop> {
        let result = match cause {
            Cause::Attention => Ok(()),
            Cause::WaitForInterrupt => self.sleep(false),
            Cause::WaitForEvent => self.wait_for_event(),
            Cause::FlashBusy => self.wait_for_flash(),
            Cause::Return(exc_return) => self.leave(exc_return),
            Cause::Supervisor => self.core.supervisor_call(),
            Cause::Breakpoint => self.core.raise(Fault::Breakpoint),
            Cause::Fault(fault) => self.core.raise(fault),
        };
        result.err().map(|lockup| self.lock_up(lockup))
    }

    fn sleep(&mut self, event: bool) -> Result<(), Lockup> {
        if self.core.system().works(Mechanism::Sleep) {
            self.state = State::Sleeping { event };
        }
        Ok(())
    }

    /// WFE: goes on at once when an event was noted, else sleeps until one.
    fn wait_for_event(&mut self) -> Result<(), Lockup> {
        if std::mem::take(&mut self.core.system_mut().run.event) { Ok(()) } else { self.sleep(true) }
    }

    fn wait_for_flash(&mut self) -> Result<(), Lockup> {
        self.state = State::Waiting;
        Ok(())
    }

    fn leave(&mut self, exc_return: u32) -> Result<(), Lockup> {
        if self.core.leave(exc_return)? { self.sleep(false) } else { Ok(()) }
    }

    fn lock_up(&mut self, Lockup { pc }: Lockup) -> Stop {
        self.state = State::LockedUp;
        Stop::Lockup { pc }
    }

    /// Does all that is due before the core may run: events, effects, resets, faults, exceptions.
    fn settle(&mut self) -> Option<Stop> {
        if self.state == State::Off {
            return None;
        }
        let system = self.core.system_mut();
        let now = system.clock.now();
        system.look(now);
        loop {
            self.core.system_mut().catch_up();
            if let Some(stop) = self.apply_effects() {
                return Some(stop);
            }
            self.reset_if_asked();
            self.end_stall();
            match self.take_exception() {
                Ok(true) => {}
                Ok(false) => break,
                Err(lockup) => return Some(self.lock_up(lockup)),
            }
        }
        self.core.note_masked();
        let system = self.core.system_mut();
        system.run.attention = false;
        system.consider();
        None
    }

    /// Takes one exception or fault that is due; whether there was one.
    fn take_exception(&mut self) -> Result<bool, Lockup> {
        self.wake();
        if self.state != State::Running || self.core.system().waits_for_flash(self.pc()) {
            return Ok(false);
        }
        if let Some(address) = self.core.system_mut().run.refused.take() {
            self.core.raise(Fault::ImpreciseBus { address })?;
        }
        match self.core.takeable() {
            Some(next) => self.core.enter(next.exception).map(|()| true),
            None => Ok(false),
        }
    }

    fn wake(&mut self) {
        if let State::Sleeping { event } = self.state
            && (self.core.wakes() || event && self.core.system().run.event)
        {
            self.state = State::Running;
        }
    }

    fn reset_if_asked(&mut self) {
        if self.core.system().scb.reset_requested {
            self.note(Incident::SoftwareReset);
            self.reset(false);
        }
    }

    fn note(&mut self, incident: Incident) {
        let system = self.core.system_mut();
        system.incidents.add(system.clock.now(), incident);
    }

    /// The chip and the core after a reset; what the chip asked for before it is void.
    fn reset(&mut self, power: bool) {
        self.end_stall_now();
        let system = self.core.system_mut();
        let now = system.clock.now();
        system.reset();
        system.peripherals.reset(power, now);
        system.look(now);
        self.core.reset_registers();
        self.state = State::Running;
    }

    /// Carries out what the chip asked for.
    fn apply_effects(&mut self) -> Option<Stop> {
        let mut stop = None;
        while let Some(effect) = self.core.system_mut().run.effects.pop_front() {
            match effect {
                Effect::Store { address, bytes } => self.store(address, &bytes),
                Effect::Fill { range, byte } => self.fill(range, byte),
                Effect::StallFlash(until) => self.stall(until),
                Effect::CoreClock(hertz) => self.set_clock(hertz),
                Effect::Reset => {
                    self.note(Incident::ChipReset);
                    self.reset(false);
                }
                Effect::PowerCut => {
                    self.power_off();
                    self.core.system_mut().run.effects.clear();
                    return Some(Stop::PowerCut);
                }
                Effect::Poke => stop = Some(Stop::Poked),
            }
        }
        stop
    }

    /// A store past the bus: DMA to nothing is lost, as on the chip.
    fn store(&mut self, address: u32, bytes: &[u8]) {
        let _ = self.write(address, bytes);
    }

    fn fill(&mut self, range: Range<u32>, byte: u8) {
        let _ = self.core.system().memory.fill(&range, byte);
        self.changed(range);
    }

    /// Memory changed under the translated code.
    fn changed(&mut self, range: Range<u32>) {
        if self.core.system().works(Mechanism::Retranslation) {
            self.core.invalidate(&range);
        }
    }

    fn set_clock(&mut self, hertz: u64) {
        let system = self.core.system_mut();
        let now = system.clock.now();
        system.clock.set_frequency(hertz);
        system.systick.set_cycle(system.clock.cycle(), now);
    }

    fn stall(&mut self, until: Time) {
        if until > self.now() {
            self.core.system_mut().run.stalled = Some(until);
            self.core.bar_flash(true);
        }
    }

    fn end_stall(&mut self) {
        let now = self.now();
        if self.core.system().run.stalled.is_some_and(|end| end <= now) {
            self.end_stall_now();
        }
    }

    fn end_stall_now(&mut self) {
        if self.core.system_mut().run.stalled.take().is_some() {
            self.core.bar_flash(false);
        }
        if self.state == State::Waiting {
            self.state = State::Running;
        }
    }
}
