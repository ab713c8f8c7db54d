//! Loads and stores by address: the way of an access to the registers of a peripheral.

use canbus::Time;

use crate::breach::Breach;
use crate::lane::Lane;
use crate::loss::Loss;
use crate::map::{self, Block, Unit};
use crate::peripherals::BusFault;
use crate::rcc::Rcc;
use crate::signature;
use crate::stm32f4::Stm32f4;
use crate::unmodelled::{Direction, Reason};

/// The reason why a write is not carried out.
enum Refusal {
    /// The model lacks the register, or the setting.
    NotModelled,
    /// The backup domain is write-protected.
    Protected,
    /// The peripheral answers with an error.
    Bus,
}

/// The two CAN controllers share one block of registers.
fn can_offset(index: usize, offset: u32) -> u32 {
    index as u32 * 0x400 + offset
}

impl Stm32f4 {
    /// A load by the core.
    pub(crate) fn core_load(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault> {
        let unit = map::find(self.variant, address).ok_or(BusFault)?.unit;
        self.refresh(unit, now);
        let value = self.load(address, size, now)?;
        // A read of these peripherals can change flags.
        if matches!(unit, Unit::Adc | Unit::AdcCommon | Unit::Dma(_) | Unit::Spi(_)) {
            self.settle(now);
        }
        Ok(value)
    }

    /// A store by the core; `true` when the store may have had an effect beyond the stored value.
    pub(crate) fn core_store(
        &mut self,
        address: u32,
        size: u8,
        value: u32,
        now: Time,
    ) -> Result<bool, BusFault> {
        let block = map::find(self.variant, address).ok_or(BusFault)?;
        self.refresh(block.unit, now);
        self.store(address, size, value, now)?;
        Ok(!block.unit.is_passive((address - block.base) & !3))
    }

    /// A load from a peripheral that has been brought up to `now`.
    pub(crate) fn load(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault> {
        let lane = Lane::of(address, size)?;
        let block = map::find(self.variant, address).ok_or(BusFault)?;
        let offset = (address - block.base) & !3;
        Ok(lane.extract(self.load_word(block, offset, now)))
    }

    /// A store to a peripheral that has been brought up to `now`.
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
        let done = self.write_unit(block.unit, offset, word, now);
        self.check_rules(block.unit, offset, word);
        match done {
            Err(Refusal::NotModelled) => self.note(block, offset, Direction::Write, Reason::NotModelled),
            Err(Refusal::Protected) => self.note(block, offset, Direction::Write, Reason::Protected),
            Err(Refusal::Bus) => return Err(BusFault),
            Ok(()) => {}
        }
        Ok(())
    }

    /// Checks the rules that a store may break.
    fn check_rules(&mut self, unit: Unit, offset: u32, value: u32) {
        match unit {
            // CAN_MCR: INRQ and SLEEP are cleared.
            Unit::Can(0) if offset == 0 && value & 0b11 == 0 => self.check_can(),
            Unit::Rcc | Unit::Pwr | Unit::Flash => {
                self.check_dividers();
                self.check_oscillator();
                self.rules.conversions_checked = false;
                self.check_clocks();
            }
            Unit::Dma(controller) => self.check_streams(controller),
            Unit::Spi(spi) => self.check_ssi(spi),
            Unit::Adc | Unit::AdcCommon | Unit::Gpio(_) => self.rules.conversions_checked = false,
            _ => {}
        }
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
        match reason {
            Reason::ClockOff => self.rules.check(false, Breach::ClockOff { name: block.name }),
            Reason::Protected => self.rules.check(false, Breach::Protected { name: block.name }),
            Reason::NotModelled => {}
        }
        self.record.add(block.name, block.base, offset, direction, reason);
    }

    /// `None` when the register is not modelled.
    fn read_unit(&mut self, unit: Unit, offset: u32, now: Time) -> Option<u32> {
        match unit {
            Unit::Rcc => self.rcc.read(offset, now),
            Unit::Pwr => self.pwr.read(offset, self.plant.supply(now)),
            Unit::Flash => self.flash.read(offset, now),
            Unit::Gpio(port) => self.ports[port].read(offset, self.outside(port, now)),
            Unit::Syscfg => self.syscfg.read(offset),
            Unit::Exti => self.exti.read(offset),
            Unit::Dbgmcu => self.dbgmcu.read(offset),
            Unit::Timer(index) => self.timers[index].read(offset),
            Unit::Adc => self.adc.read(offset),
            Unit::AdcCommon => self.adc_common.read(offset, self.adc.status()),
            Unit::Dma(index) => self.dmas[index].read(offset),
            Unit::Can(index) => self.can.read(can_offset(index, offset), now),
            Unit::Spi(index) => self.spis[index].read(offset),
            Unit::Iwdg => self.iwdg.read(offset, now),
            Unit::Crc => self.crc.read(offset),
            Unit::BackupRam => self.backup_ram.read(offset),
            Unit::Signature => {
                self.rules.check(!self.flash.is_busy(now), Breach::SystemMemory);
                signature::read(self.variant, self.board.unique_id, offset)
            }
            Unit::Options => self.flash.option_bytes(offset),
            Unit::Absent => None,
        }
    }

    fn write_unit(&mut self, unit: Unit, offset: u32, value: u32, now: Time) -> Result<(), Refusal> {
        let done = match unit {
            Unit::Rcc => self.write_rcc(offset, value, now),
            Unit::Pwr => {
                let before = self.pwr.scale();
                let done = self.pwr.write(offset, value);
                self.check_regulator(before);
                done
            }
            Unit::Flash => {
                let done = self.flash.write(offset, value, now, &mut self.effects);
                self.check_flash_supply(now);
                done.map_err(|BusFault| Refusal::Bus)?
            }
            Unit::Gpio(port) => self.ports[port].write(offset, value),
            Unit::Syscfg => self.syscfg.write(offset, value),
            Unit::Exti => self.exti.write(offset, value),
            Unit::Dbgmcu => self.dbgmcu.write(offset, value),
            Unit::Timer(index) => self.write_timer(index, offset, value, now),
            Unit::Adc => self.write_adc(offset, value, now),
            Unit::AdcCommon => self.write_adc_common(offset, value),
            Unit::Dma(index) => self.dmas[index].write(offset, value),
            Unit::Can(index) => self.can.write(can_offset(index, offset), value, now),
            Unit::Spi(index) => self.spis[index].write(offset, value, now),
            Unit::Iwdg => self.write_iwdg(offset, value, now),
            Unit::Crc => self.crc.write(offset, value),
            Unit::BackupRam if !self.pwr.backup_is_writable() => return Err(Refusal::Protected),
            Unit::BackupRam if self.losses.take(Loss::BackupStore) => Some(()),
            Unit::BackupRam => self.backup_ram.write(offset, value),
            Unit::Signature | Unit::Options | Unit::Absent => None,
        };
        done.ok_or(Refusal::NotModelled)
    }

    /// Brings the state that an access can see up to `now`.
    fn refresh(&mut self, unit: Unit, now: Time) {
        match unit {
            Unit::Timer(index) => {
                self.convert(now);
                self.run_timer(index, now);
            }
            Unit::Adc | Unit::AdcCommon | Unit::Dma(_) => self.convert(now),
            Unit::Spi(index) => self.run_spi(index, now),
            Unit::Flash => self.flash.advance(now, &mut self.effects),
            _ => {}
        }
    }

    fn write_timer(&mut self, index: usize, offset: u32, value: u32, now: Time) -> Option<()> {
        let done = self.timers[index].write(offset, value, now);
        self.pass_trigger(index, now);
        // DMA at an update is modelled only for the timer that also starts the ADC.
        let served = !self.timers[index].requests_on_update() || self.trigger_timer() == Some(index);
        done.filter(|()| served)
    }

    fn write_adc(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        let done = self.adc.write(offset, value, now);
        self.attach_trigger(now);
        done
    }

    fn write_adc_common(&mut self, offset: u32, value: u32) -> Option<()> {
        let done = self.adc_common.write(offset, value);
        self.adc.set_cycle(self.adc_cycle());
        done
    }

    fn write_iwdg(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        let done = self.iwdg.write(offset, value, now);
        if self.iwdg.is_running() {
            self.rcc.start_lsi(now);
        }
        done
    }

    fn write_rcc(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        self.catch_up(now);
        let done = self.rcc.write(offset, value, now);
        if self.iwdg.is_running() {
            // The watchdog keeps the LSI on, whatever the value of LSION.
            self.rcc.start_lsi(now);
        }
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
