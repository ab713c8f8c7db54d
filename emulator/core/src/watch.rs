//! Stops a program before an instruction and returns to that moment later. Tests with injected faults use this to
//! continue the same moment in many ways.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use canbus::Time;
use chip::Peripherals;
use unicorn_engine::{Context, RegisterARM, UcHookId};

use crate::core::CoreMoment;
use crate::engine;
use crate::it_block;
use crate::machine::Machine;
use crate::model::Error;
use crate::stepping;

/// A visit of an instruction: its address and the number of the visit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Point {
    /// The address of the instruction.
    pub address: u32,
    /// The number of the visit: 1 is the first.
    pub visit: u64,
}

/// A condition flag of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Flag {
    /// Negative.
    N,
    /// Zero.
    Z,
    /// Carry.
    C,
    /// Overflow.
    V,
}

impl Flag {
    /// All of them.
    pub const ALL: [Flag; 4] = [Flag::N, Flag::Z, Flag::C, Flag::V];

    /// In the register APSR.
    fn bit(self) -> u32 {
        1 << (31 - self as u32)
    }
}

/// The state of the watch.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    visits: HashMap<u32, u64>,
    stops: HashSet<Point>,
    /// The instructions of an IT block that has begun: the CPU library does not stop inside an IT block.
    conditional: Range<u32>,
    /// If set: stop before the first instruction outside this range, without counting.
    outside: Option<Range<u32>>,
    /// The point at which the program was stopped; this visit is not counted yet.
    pub(crate) stopped: Option<Point>,
}

impl Watch {
    /// Counts an instruction that is about to run, or returns `true` to stop before it.
    pub(crate) fn stops_before(&mut self, address: u32, size: u32, block: u32) -> bool {
        if let Some(inside) = &self.outside {
            return !inside.contains(&address);
        }
        let visit = self.visits.get(&address).copied().unwrap_or(0) + 1;
        let point = Point { address, visit };
        let goes_on = self.stopped.take() == Some(point);
        if !goes_on && !self.conditional.contains(&address) && self.stops.contains(&point) {
            self.stopped = Some(point);
            return true;
        }
        self.visits.insert(address, visit);
        if block > size {
            self.conditional = address + size..address + block;
        }
        false
    }
}

/// A saved state of a machine, to return to.
pub struct Moment<P> {
    registers: Context,
    core: CoreMoment<P>,
    memory: [Vec<u8>; 2],
    machine: (bool, Option<u32>, Time, bool),
}

impl<P: Peripherals + 'static> Machine<P> {
    /// From now on, counts the visits of each instruction and stops before each of these points. Execution is several
    /// times slower.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn watch(&mut self, stops: impl IntoIterator<Item = Point>) -> Result<(), Error> {
        self.unwatch()?;
        let watch = Watch { stops: stops.into_iter().collect(), ..Watch::default() };
        self.cpu.get_data_mut().watch = Some(watch);
        self.resume_watch()
    }

    /// The number of visits of each watched instruction, by rising addresses.
    pub fn visits(&self) -> Vec<Point> {
        let visits = self.cpu.get_data().watch.iter().flat_map(|watch| &watch.visits);
        let mut all: Vec<Point> = visits.map(|(&address, &visit)| Point { address, visit }).collect();
        all.sort_by_key(|point| point.address);
        all
    }

    /// The point at which the program was stopped.
    pub fn stopped(&self) -> Option<Point> {
        self.cpu.get_data().watch.as_ref()?.stopped
    }

    /// Stops counting and stopping, and runs at full speed, until [`Machine::resume_watch`].
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn unwatch(&mut self) -> Result<(), Error> {
        if let Some(hook) = self.watching.take() {
            self.cpu.remove_hook(hook)?;
            self.cpu.ctl_flush_tb()?;
        }
        Ok(())
    }

    /// Resumes counting and stopping.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn resume_watch(&mut self) -> Result<(), Error> {
        if self.watching.is_none() {
            let hook: UcHookId = engine::watch(&mut self.cpu)?;
            self.watching = Some(hook);
        }
        Ok(())
    }

    /// The current state of the machine, without the counters.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn moment(&self) -> Result<Moment<P>, Error>
    where
        P: Clone,
    {
        let (model, core) = (self.model(), self.cpu.get_data());
        let copy = |range: &Range<u32>| {
            let mut bytes = vec![0; range.len()];
            let _ = self.read(range.start, &mut bytes);
            bytes
        };
        Ok(Moment {
            registers: self.cpu.context_init()?,
            core: core.moment(),
            memory: [copy(&model.flash), copy(&model.ram)],
            machine: self.state(),
        })
    }

    /// Returns to a moment of this machine.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn go_back(&mut self, moment: &Moment<P>) -> Result<(), Error>
    where
        P: Clone,
    {
        /// Size of a piece to compare. Most of memory is unchanged, and its translated code is kept.
        const CHUNK: usize = 1024;
        let starts = [self.model().flash.start, self.model().ram.start];
        for (start, bytes) in starts.into_iter().zip(&moment.memory) {
            for (address, chunk) in (start..).step_by(CHUNK).zip(bytes.chunks(CHUNK)) {
                let mut now = [0; CHUNK];
                let _ = self.read(address, &mut now[..chunk.len()]);
                if now[..chunk.len()] != *chunk {
                    engine::store(&mut self.cpu, address, chunk)?;
                }
            }
        }
        self.set_state(moment.machine);
        self.cpu.get_data_mut().go_back(&moment.core);
        self.cpu.get_data_mut().memory.protection_is_new = true;
        self.cpu.context_restore(&moment.registers)?;
        Ok(())
    }

    /// The next instruction, and those of its block if it is an IT instruction: address and length of each.
    pub fn next_instructions(&self) -> Vec<(u32, u32)> {
        self.instructions_at(self.pc())
    }

    /// The same of the instruction at an address.
    pub fn instructions_at(&self, address: u32) -> Vec<(u32, u32)> {
        let mut code = [0; stepping::LONGEST_BLOCK];
        // Unreadable code stays zero.
        let _ = self.read(address, &mut code);
        stepping::instructions(&code).into_iter().map(|(at, size)| (address + at, size)).collect()
    }

    /// Skips the next instruction, or any instruction of the IT block that is next; the other instructions of the block
    /// run according to their conditions.
    ///
    /// # Errors
    /// When the CPU library reports an error.
    pub fn skip(&mut self, (address, size): (u32, u32)) -> Result<(), Error> {
        if address == self.pc() {
            self.set(RegisterARM::PC, (address + size) | 1);
            return Ok(());
        }
        let (first, block) = (self.pc(), self.next_instructions());
        let end = block.last().map_or(address + size, |(last, size)| last + size);
        let mut original = [0; 4];
        let original = &mut original[..size as usize];
        let _ = self.read(address, original);
        engine::store(&mut self.cpu, address, &NOPS[..size as usize])?;
        self.run_until_outside(first..end)?;
        engine::store(&mut self.cpu, address, original)
    }

    /// Continues up to this instruction of the next IT block, so that a fault can come between two instructions of the block.
    /// Does nothing for an instruction outside of the block, and for the IT instruction.
    ///
    /// # Errors
    /// When the CPU library refuses.
    pub fn go_into_block(&mut self, address: u32) -> Result<(), Error> {
        let index = self.next_instructions().iter().position(|(at, _)| *at == address);
        let Some(before) = index.and_then(|index| index.checked_sub(1)) else { return Ok(()) };
        let mut it = [0];
        let _ = self.read(self.pc(), &mut it);
        self.run_start_of_block(address, it, before)?;
        // After a fault in the start of the block the rest of the block does not follow.
        if self.pc() == address {
            let rest = (0..before).fold(it[0], |it, _| it_block::advanced(it));
            let xpsr = self.register(RegisterARM::XPSR);
            self.set_xpsr(xpsr & !it_block::STATE | it_block::state(rest));
        }
        Ok(())
    }

    /// The first `count` instructions of an IT block. The library stops at the end of a block only: so the block is made to end there.
    fn run_start_of_block(&mut self, end: u32, it: [u8; 1], count: usize) -> Result<(), Error> {
        let first = self.pc();
        if count == 0 {
            self.set(RegisterARM::PC, end | 1);
            return Ok(());
        }
        engine::store(&mut self.cpu, first, &[it_block::shortened(it[0], count)])?;
        self.run_until_outside(first..end)?;
        engine::store(&mut self.cpu, first, &it)
    }

    /// Changes one condition flag.
    pub fn flip_flag(&mut self, flag: Flag) {
        let flags = self.register(RegisterARM::APSR_NZCV);
        self.set(RegisterARM::APSR_NZCV, flags ^ flag.bit());
    }

    /// Flips one bit of R0 to R14.
    pub fn flip(&mut self, register: u8, bit: u8) {
        let value = engine::core_register(&self.cpu, register.into());
        self.set_register(register, value ^ 1 << bit);
    }

    fn run_until_outside(&mut self, block: Range<u32>) -> Result<(), Error> {
        /// Longer than any IT block takes.
        const ENOUGH: Time = Time::from_micros(10);
        let kept = self.cpu.get_data_mut().watch.replace(Watch { outside: Some(block), ..Watch::default() });
        self.resume_watch()?;
        let until = self.now() + ENOUGH;
        self.run_until(until);
        self.unwatch()?;
        self.cpu.get_data_mut().watch = kept;
        Ok(())
    }
}

/// Two instructions that do nothing.
const NOPS: [u8; 4] = [0x00, 0xBF, 0x00, 0xBF];
