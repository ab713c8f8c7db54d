//! Timing of the chip: the events without an access by the core, their deadlines, and the interrupt lines.

use canbus::Time;

use crate::breach::Breach;
use crate::can::Lines;
use crate::clocks::Apb;
use crate::iwdg::Iwdg;
use crate::loss::Loss;
use crate::map::{ADC_IRQ, CAN_IRQS, DMA_IRQS, FLASH_IRQ, SPIS, TIMERS};
use crate::peripherals::{BusFault, Effect, FlashAccess, IrqLines, Memory, Peripherals};
use crate::rcc::Cause;
use crate::spi::Far;
use crate::stm32f4::Stm32f4;
use crate::timer::{LSI_CHANNEL, Timer};
use crate::variant::Variant;

/// Indexes into `TIMERS` and `SPIS`.
const TIM2: usize = 0;
const SPI2: usize = 1;

impl Peripherals for Stm32f4 {
    fn read(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault> {
        self.pass(now);
        self.core_load(address, size, now)
    }

    fn write(&mut self, address: u32, size: u8, value: u32, now: Time) -> Result<(), BusFault> {
        self.pass(now);
        if self.core_store(address, size, value, now)? {
            self.settle(now);
        }
        Ok(())
    }

    fn program(&mut self, address: u32, old: &[u8], new: &[u8], now: Time) -> Result<(), BusFault> {
        self.pass(now);
        self.flash.advance(now, &mut self.effects);
        self.flash.program(address, old, new, now, &mut self.effects)?;
        self.check_flash_supply(now);
        self.settle(now);
        Ok(())
    }

    fn apb_divider(&self, address: u32) -> Option<u32> {
        match address >> 16 {
            0x4000 => Some(self.clocks.divider(Apb::One)),
            0x4001 => Some(self.clocks.divider(Apb::Two)),
            _ => None,
        }
    }

    /// RM0390 table 38, RM0090 tables 61 and 62.
    fn interrupts(&self) -> u32 {
        if self.variant == Variant::F446 { 97 } else { 82 }
    }

    /// A clock that is switched on comes two cycles of the AHB later, or one and the divider of the APB (ES0298 and ES0182,
    /// delay after an RCC peripheral clock enabling).
    fn settling(&self, address: u32) -> u32 {
        match address {
            0x4002_3830..=0x4002_383B => 2,
            0x4002_3840..=0x4002_3843 => 1 + self.clocks.divider(Apb::One),
            0x4002_3844..=0x4002_3847 => 1 + self.clocks.divider(Apb::Two),
            _ => 0,
        }
    }

    fn flash_access(&self) -> FlashAccess {
        self.flash.access()
    }

    fn deadline(&self) -> Time {
        self.deadline.min(self.can.deadline())
    }

    fn advance(&mut self, now: Time, memory: &dyn Memory) {
        if now >= self.deadline() {
            self.catch_up(now);
            self.feed_spis(now, memory);
            self.settle(now);
        }
    }

    fn lines(&self) -> IrqLines {
        // The bus changes the CAN controllers directly, so their lines are read here.
        let mut lines = self.lines;
        for (irqs, Lines { tx, rx0, rx1, sce }) in CAN_IRQS.iter().zip(self.can.lines()) {
            irqs.iter().zip([tx, rx0, rx1, sce]).for_each(|(&irq, level)| lines.raise(irq, level));
        }
        lines
    }

    fn slept(&mut self, address: u32) {
        self.check_sleep(address);
    }

    fn take_change(&mut self) -> bool {
        std::mem::take(&mut self.has_settled) || !self.effects.is_empty() || self.rules.any_broken()
    }

    fn breach(&mut self) -> Option<Breach> {
        self.rules.take()
    }

    fn effect(&mut self) -> Option<Effect> {
        self.effects.pop_front()
    }

    fn reset(&mut self, power: bool, now: Time) {
        if power {
            // Without a supply the watchdog has not run.
            self.asked = None;
            self.effects.retain(|effect| *effect != Effect::Reset);
        } else {
            self.convert(now);
        }
        self.reset_all(power, now);
        self.settle(now);
    }
}

impl Stm32f4 {
    /// Processes everything that is visible up to `now`.
    fn pass(&mut self, now: Time) {
        if now >= self.deadline() {
            self.catch_up(now);
            self.settle(now);
        }
    }

    /// Brings every peripheral up to `now`.
    pub(crate) fn catch_up(&mut self, now: Time) {
        self.convert(now);
        self.watch_index(now);
        for index in 0..self.timers.len() {
            self.run_timer(index, now);
        }
        for index in 0..self.spis.len() {
            self.run_spi(index, now);
        }
        self.can.advance(now);
        self.flash.advance(now, &mut self.effects);
        self.rcc.set_hse(self.board.hse.filter(|_| self.plant.has_crystal(now)), now);
        self.rcc.advance(now);
        self.update_clocks(now);
        self.watch(now);
    }

    pub(crate) fn run_timer(&mut self, index: usize, now: Time) {
        if TIMERS[index].kind.sees_lsi {
            self.capture_lsi(index, now);
        }
        let position = self.encoder_position(index, now);
        let before = self.timers[index].matches();
        self.timers[index].run(now, position);
        if index == TIM2 {
            self.lose_matches(before);
        }
    }

    /// Captures the last edge of the LSI. The edges are no events: a program sees them when it reads the timer.
    fn capture_lsi(&mut self, index: usize, now: Time) {
        let cycle = Time::of_cycle(self.board.lsi.into());
        let edge = Time(now.0 - now.0 % cycle.0);
        if edge > self.lsi_looked && self.timers[index].measures_lsi() && self.rcc.lsi_runs(edge) {
            self.timers[index].run(edge, None);
            self.timers[index].capture(LSI_CHANNEL, true);
        }
        self.lsi_looked = now;
    }

    /// Clears the match flags of TIM2 that a test makes the chip lose.
    fn lose_matches(&mut self, before: u32) {
        let fresh = self.timers[TIM2].matches() & !before;
        for channel in (1..=4).filter(|channel| fresh >> channel & 1 != 0) {
            if self.losses.take(Loss::Compare { channel }) {
                self.timers[TIM2].forget_match(channel);
            }
        }
    }

    /// Ends the frames of an SPI that are due, and lets DMA read the received data.
    pub(crate) fn run_spi(&mut self, index: usize, now: Time) {
        let (wired, open) = (self.ssi_is_wired(index), Far::Nothing(self.open_input(index)));
        let plant = &self.plant;
        self.spis[index].run(now, |at| plant.absolute(at).filter(|_| wired).map_or(open, Far::Encoder));
        let place = &SPIS[index];
        if index == SPI2 && self.spis[index].asks_to_store() && self.losses.take(Loss::SpiByte) {
            self.spis[index].lose();
        }
        while self.spis[index].asks_to_store()
            && self.transfer_to_memory(place.dma, &place.receive, now).is_some()
        {}
    }

    /// Lets DMA write the next data to send to the SPIs.
    fn feed_spis(&mut self, now: Time, memory: &dyn Memory) {
        for (index, place) in SPIS.iter().enumerate() {
            while self.spis[index].asks_to_load()
                && self.transfer_to_peripheral(place.dma, &place.transmit, memory, now).is_some()
            {
            }
        }
    }

    /// Resets the chip when the watchdog has expired.
    fn watch(&mut self, now: Time) {
        if now >= self.iwdg.deadline() {
            self.iwdg = Iwdg::new(self.board.lsi);
            self.asked = Some(Cause::Watchdog);
            self.effects.push_back(Effect::Reset);
        }
    }

    /// Recomputes the deadline and the interrupt lines after a change.
    pub(crate) fn settle(&mut self, now: Time) {
        self.deadline = self.next_event(now);
        self.lines = self.levels();
        self.has_settled = true;
        if self.can.take_poke() {
            self.effects.push_back(Effect::Poke);
        }
    }

    fn next_event(&self, now: Time) -> Time {
        let timers = self.timers.iter().map(Timer::deadline);
        let spis = (0..self.spis.len()).map(|index| self.spi_deadline(index, now));
        let others = [
            self.rcc.deadline(),
            self.plant.next_crystal_edge(now),
            self.conversion_deadline(),
            self.encoder_deadline(now),
            self.flash.deadline(),
            self.iwdg.deadline(),
        ];
        timers.chain(spis).chain(others).fold(Time::NEVER, Time::min)
    }

    fn spi_deadline(&self, index: usize, now: Time) -> Time {
        let (spi, place) = (&self.spis[index], &SPIS[index]);
        let feeds = spi.asks_to_load() && self.dmas[place.dma].serves(&place.transmit).is_some();
        if feeds { now } else { spi.deadline() }
    }

    fn levels(&self) -> IrqLines {
        let mut lines = IrqLines { nmi: self.rcc.clock_has_failed(), ..IrqLines::default() };
        let mut raise = |irq: u8, level: bool| lines.raise(irq, level);
        self.timers.iter().zip(&TIMERS).for_each(|(timer, place)| raise(place.irq, timer.interrupt()));
        self.spis.iter().zip(&SPIS).for_each(|(spi, place)| raise(place.irq, spi.interrupt()));
        for (dma, irqs) in self.dmas.iter().zip(DMA_IRQS) {
            dma.interrupts().zip(irqs).for_each(|(level, irq)| raise(irq, level));
        }
        self.exti.interrupts().for_each(|(irq, level)| raise(irq, level));
        raise(ADC_IRQ, self.adc.interrupt());
        raise(FLASH_IRQ, self.flash.interrupt());
        lines
    }
}
