//! Loads and stores by address: from the bus to the registers of the peripherals.

use canbus::Time;

use crate::lane::Lane;
use crate::map::{self, Block, Unit};
use crate::peripherals::BusFault;
use crate::rcc::Rcc;
use crate::stm32f4::Stm32f4;
use crate::unmodelled::{Direction, Reason};

impl Stm32f4 {
    /// A load by the core or by DMA.
    pub(crate) fn load(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault> {
        let lane = Lane::of(address, size)?;
        let block = map::find(self.variant, address).ok_or(BusFault)?;
        let offset = (address - block.base) & !3;
        Ok(lane.extract(self.load_word(block, offset, now)))
    }

    /// A store by the core or by DMA.
    pub(crate) fn store(&mut self, address: u32, size: u8, value: u32, now: Time) -> Result<(), BusFault> {
        let lane = Lane::of(address, size)?;
        let block = map::find(self.variant, address).ok_or(BusFault)?;
        let offset = (address - block.base) & !3;
        if !self.clocked(block) {
            self.note(block, offset, Direction::Write, Reason::ClockOff);
            return Ok(());
        }
        let word = match size {
            4 => value,
            _ if block.has_byte_lanes() => lane.insert(self.load_word(block, offset, now), value),
            _ => lane.repeat(value),
        };
        if self.write_unit(block.unit, offset, word, now).is_none() {
            self.note(block, offset, Direction::Write, Reason::NotModelled);
        }
        Ok(())
    }

    fn load_word(&mut self, block: &Block, offset: u32, now: Time) -> u32 {
        if !self.clocked(block) {
            self.note(block, offset, Direction::Read, Reason::ClockOff);
            return 0;
        }
        self.read_unit(block.unit, offset, now).unwrap_or_else(|| {
            self.note(block, offset, Direction::Read, Reason::NotModelled);
            0
        })
    }

    fn clocked(&self, block: &Block) -> bool {
        block.gate.is_none_or(|gate| self.rcc.enabled(gate))
    }

    fn note(&mut self, block: &Block, offset: u32, direction: Direction, reason: Reason) {
        self.record.add(block.name, block.base, offset, direction, reason);
    }

    /// `None` when the register is not modelled.
    fn read_unit(&mut self, unit: Unit, offset: u32, now: Time) -> Option<u32> {
        match unit {
            Unit::Rcc => self.rcc.read(offset, now),
            Unit::Pwr => self.pwr.read(offset),
            Unit::Flash => self.flash.read(offset),
            Unit::Gpio(port) => self.ports[port].read(offset, self.outside[port]),
            Unit::Syscfg => self.syscfg.read(offset),
            Unit::Dbgmcu => self.dbgmcu.read(offset),
            Unit::Timer(index) => {
                self.run_timer(index, now);
                self.timers[index].read(offset)
            }
            Unit::Absent => None,
        }
    }

    /// `None` when the register, or a setting of it, is not modelled.
    fn write_unit(&mut self, unit: Unit, offset: u32, value: u32, now: Time) -> Option<()> {
        match unit {
            Unit::Rcc => self.write_rcc(offset, value, now),
            Unit::Pwr => self.pwr.write(offset, value),
            Unit::Flash => self.flash.write(offset, value),
            Unit::Gpio(port) => self.ports[port].write(offset, value),
            Unit::Syscfg => self.syscfg.write(offset, value),
            Unit::Dbgmcu => self.dbgmcu.write(offset, value),
            Unit::Timer(index) => {
                self.run_timer(index, now);
                self.timers[index].write(offset, value, now)
            }
            Unit::Absent => None,
        }
    }

    fn write_rcc(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        let done = self.rcc.write(offset, value, now);
        self.rcc.advance(now);
        self.update_clocks(now);
        if Rcc::is_reset_register(offset) {
            self.reset_held_units();
        }
        done
    }

    fn reset_held_units(&mut self) {
        let held = |block: &&Block| block.gate.is_some_and(|gate| self.rcc.held_in_reset(gate));
        let units: Vec<Unit> = map::blocks().filter(held).map(|block| block.unit).collect();
        units.into_iter().for_each(|unit| self.reset_unit(unit));
    }
}
