//! Clocks and resets from RCC to the peripherals.

use canbus::Time;

use crate::adc::AdcCommon;
use crate::backup_ram::BackupRam;
use crate::clocks::Clocks;
use crate::crc_unit::CrcUnit;
use crate::dma::Dma;
use crate::exti::Exti;
use crate::gpio::Gpio;
use crate::iwdg::Iwdg;
use crate::map::{self, SPIS, TIMERS, Unit};
use crate::peripherals::Effect;
use crate::rcc::Cause;
use crate::stm32f4::Stm32f4;
use crate::syscfg::Syscfg;
use crate::timer::Timer;

impl Stm32f4 {
    /// A reset of the whole chip: by the supply (`power`) or for the cause that a peripheral has set. A loss of the
    /// supply takes effect here, when the supply returns: only now is it known whether the battery has kept the backup
    /// domain.
    pub(crate) fn reset_all(&mut self, power: bool, now: Time) {
        if power && !self.backup_is_kept(now) {
            self.backup_ram = BackupRam::default();
            self.pwr.keep_backup(false);
        } else if power && self.plant.has_weak_battery(now) {
            self.backup_ram.decay();
        }
        let cause = self.asked.take().unwrap_or(Cause::Software);
        self.rcc.reset((!power).then_some(cause));
        self.flash.reset(&mut self.effects);
        self.clocks = Clocks::RESET;
        self.announce_clock();
        map::blocks().for_each(|block| self.reset_unit(block.unit));
        self.apply_clocks(now);
    }

    /// Tells every clocked unit the current clock tree; all units have been brought up to `now`.
    pub(crate) fn update_clocks(&mut self, now: Time) {
        let clocks = self.rcc.clocks();
        if clocks == self.clocks {
            return;
        }
        let core_changed = clocks.hclk != self.clocks.hclk;
        self.clocks = clocks;
        self.apply_clocks(now);
        self.check_clocks();
        if core_changed {
            self.announce_clock();
        }
    }

    fn apply_clocks(&mut self, now: Time) {
        for (timer, place) in self.timers.iter_mut().zip(&TIMERS) {
            timer.set_cycle(self.clocks.timer_cycle(place.bus), now);
        }
        for (spi, place) in self.spis.iter_mut().zip(&SPIS) {
            spi.set_pclk(self.clocks.apb_cycle(place.bus));
        }
        self.adc.set_cycle(self.adc_cycle());
        self.can.set_clock(self.clocks.pclk1());
    }

    pub(crate) fn announce_clock(&mut self) {
        self.effects.push_back(Effect::CoreClock(self.clocks.hclk));
    }

    /// Puts one peripheral into its reset state. FLASH and RCC have resets of their own.
    pub(crate) fn reset_unit(&mut self, unit: Unit) {
        match unit {
            Unit::Timer(index) => {
                let place = &TIMERS[index];
                self.timers[index] = Timer::new(place.kind, self.clocks.timer_cycle(place.bus));
            }
            Unit::Gpio(port) => self.ports[port] = Gpio::new(port),
            Unit::Pwr => self.pwr.reset(),
            Unit::Syscfg => self.syscfg = Syscfg::new(),
            Unit::Exti => self.exti = Exti::default(),
            Unit::Adc => self.adc.reset(),
            Unit::AdcCommon => self.adc_common = AdcCommon::default(),
            Unit::Dma(index) => self.dmas[index] = Dma::default(),
            Unit::Spi(index) => self.spis[index].reset(),
            Unit::Can(0) => self.can.reset_can1(),
            Unit::Can(_) => self.can.reset_can2(),
            Unit::Iwdg => self.iwdg = Iwdg::new(self.board.lsi),
            Unit::Crc => self.crc = CrcUnit::new(),
            Unit::Rcc
            | Unit::Flash
            | Unit::Dbgmcu
            | Unit::BackupRam
            | Unit::Signature
            | Unit::Options
            | Unit::Absent => {}
        }
    }
}
