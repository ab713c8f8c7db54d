//! From the trigger to memory: the cooperation of timer, ADC and DMA.
//!
//! Conversions are computed only when their results are needed: at an access to timer, ADC or DMA, at an interrupt, and
//! at each half and full transfer, when the data reaches memory. Each conversion still uses the voltage of its own
//! instant. The copies of the encoder's count that DMA makes at the same triggers work in the same way.

use canbus::Time;

use crate::adc::{Sample, Trigger};
use crate::clocks::times;
use crate::dma::{Direction, Line, Stream, Transfer, line};
use crate::loss::Loss;
use crate::map::TIM3_UPDATE;
use crate::peripherals::{BusFault, Effect, Memory};
use crate::plant::front_end::quantise;
use crate::stm32f4::Stm32f4;

/// DMA1 and DMA2, as an index.
const DMA1: usize = 0;
const DMA2: usize = 1;
/// TIM3 and TIM4, as an index.
const TIM3: usize = 1;
const TIM4: usize = 2;
/// The requests of ADC1 (RM0390 table 29).
const ADC1: [Line; 2] = [line(0, 0), line(4, 0)];
/// ADC1 channel of the internal reference.
const REFERENCE: u32 = 17;

/// Memory that DMA can reach: SRAM1 and SRAM2, and flash for reads. The CCM of the F405 is not on the bus of the DMA
/// controllers (RM0090 section 2.1).
const RAM: std::ops::Range<u32> = 0x2000_0000..0x2002_0000;

impl Stm32f4 {
    /// Computes every conversion that ended up to `now`.
    pub(crate) fn convert(&mut self, now: Time) {
        loop {
            let end = self.adc.conversion_end();
            let trigger = self.next_trigger().0;
            if end.min(trigger) > now {
                return;
            }
            if end <= trigger {
                self.finish_conversion(end);
            } else {
                self.trigger_conversion(trigger);
            }
        }
    }

    /// The instant of the next TRGO of the timer that triggers the ADC, and the shortest span to the following TRGO.
    fn next_trigger(&self) -> (Time, Time) {
        let never = (Time::NEVER, Time::ZERO);
        self.trigger_timer().map_or(never, |timer| self.timers[timer].trigger_output())
    }

    pub(crate) fn trigger_timer(&self) -> Option<usize> {
        self.adc.trigger().map(|trigger| match trigger {
            Trigger::Tim2 => 0,
            Trigger::Tim3 => 1,
        })
    }

    fn trigger_conversion(&mut self, at: Time) {
        if let Some(timer) = self.trigger_timer() {
            self.run_timer(timer, at);
            self.adc.on_trigger(at);
            if timer == TIM3 && self.timers[TIM3].requests_on_update() {
                self.copy_count(&TIM3_UPDATE, at);
            }
        }
    }

    /// Passes on a TRGO that a software update event has caused.
    pub(crate) fn pass_trigger(&mut self, timer: usize, now: Time) {
        if self.timers[timer].take_trigger() && self.trigger_timer() == Some(timer) {
            self.adc.on_trigger(now);
        }
    }

    /// Brings the timer that has just been selected as trigger up to `now`: its earlier triggers do not count.
    pub(crate) fn attach_trigger(&mut self, now: Time) {
        if let Some(timer) = self.trigger_timer() {
            self.run_timer(timer, now);
        }
    }

    fn finish_conversion(&mut self, at: Time) {
        self.check_conversions();
        self.check_stability();
        let code = self.adc.sample().map_or(0, |sample| quantise(self.analogue(sample)));
        self.adc.finish(code);
        if self.adc.requests() {
            self.transfer_conversion(at);
        }
    }

    /// The voltage on an input of ADC1 as a ratio of VDDA; an unconnected input is at ground.
    fn analogue(&self, Sample { channel, at }: Sample) -> f64 {
        let sensors = self.adc_common.sensors_on();
        match channel {
            0 => self.plant.pressure_input(at),
            1 => self.plant.supply_input(),
            12 => self.plant.thermistor_input(at),
            REFERENCE if sensors => self.plant.reference_input(),
            _ if sensors && channel == self.variant.temperature_channel() => self.plant.temperature_input(at),
            _ => 0.0,
        }
    }

    fn transfer_conversion(&mut self, at: Time) {
        if let Some(last) = self.transfer_to_memory(DMA2, &ADC1, at) {
            self.adc.served(last);
        }
    }

    /// Serves a request towards memory. `Some(true)` for the last transfer of a round of the stream; `None` when no
    /// stream serves the request.
    pub(crate) fn transfer_to_memory(
        &mut self,
        controller: usize,
        request: &[Line],
        at: Time,
    ) -> Option<bool> {
        let transfer = self.dmas[controller].serves(request)?.next();
        if transfer.direction != Direction::PeripheralToMemory || self.is_lost(controller, request) {
            return None;
        }
        let moved = self.move_to_memory(transfer, at);
        Some(self.account(controller, request, moved))
    }

    /// Whether a test suppresses the request.
    fn is_lost(&mut self, controller: usize, request: &[Line]) -> bool {
        if self.losses.is_empty() {
            return false;
        }
        let stream = self.dmas[controller].line(request).map(|line| line.stream);
        stream.is_some_and(|stream| self.losses.take(Loss::DmaRequest { controller: controller + 1, stream }))
    }

    fn move_to_memory(&mut self, transfer: Transfer, at: Time) -> Result<(), BusFault> {
        if !RAM.contains(&transfer.memory) {
            return Err(BusFault);
        }
        let value = self.load(transfer.peripheral, transfer.size, at)?;
        self.keep(transfer.memory, &value.to_le_bytes()[..usize::from(transfer.size)]);
        Ok(())
    }

    /// Serves a request of TIM3 whose stream may copy the count of the encoder.
    pub(crate) fn copy_count(&mut self, request: &[Line], at: Time) {
        self.run_timer(TIM4, at);
        self.transfer_to_memory(DMA1, request, at);
    }

    /// Serves a request towards a peripheral.
    pub(crate) fn transfer_to_peripheral(
        &mut self,
        controller: usize,
        request: &[Line],
        memory: &dyn Memory,
        at: Time,
    ) -> Option<bool> {
        let transfer = self.dmas[controller].serves(request)?.next();
        if transfer.direction != Direction::MemoryToPeripheral {
            return None;
        }
        let mut bytes = [0; 4];
        let moved = memory
            .load(transfer.memory, &mut bytes[..usize::from(transfer.size)])
            .and_then(|()| self.store(transfer.peripheral, transfer.size, u32::from_le_bytes(bytes), at));
        Some(self.account(controller, request, moved))
    }

    fn account(&mut self, controller: usize, request: &[Line], moved: Result<(), BusFault>) -> bool {
        let Some(stream) = self.dmas[controller].serving(request) else { return false };
        match moved {
            Ok(()) => stream.done(),
            Err(BusFault) => {
                stream.fail();
                false
            }
        }
    }

    /// Stores to memory. A store that continues one of the last two is joined with it; two because two streams may
    /// alternate.
    fn keep(&mut self, address: u32, new: &[u8]) {
        let recent = self.effects.iter_mut().rev().take(2).map_while(|effect| match effect {
            Effect::Store { address, bytes } => Some((*address, bytes)),
            _ => None,
        });
        let before = |(start, bytes): &(u32, &mut Vec<u8>)| start.wrapping_add(bytes.len() as u32) == address;
        match recent.into_iter().find(before) {
            Some((_, bytes)) => bytes.extend_from_slice(new),
            None => self.effects.push_back(Effect::Store { address, bytes: new.to_vec() }),
        }
    }

    /// The next instant at which conversions have a visible effect: an interrupt or a completed transfer.
    pub(crate) fn conversion_deadline(&self) -> Time {
        let trigger = self.next_trigger();
        let seen = |count| self.adc.end_after(count, trigger);
        let until_event = |stream: &Stream| {
            let fails = !RAM.contains(&stream.next().memory);
            if fails { 1 } else { stream.until_event() as usize }
        };
        match self.dmas[DMA2].serves(&ADC1).map(until_event) {
            _ if self.adc.awaits_interrupt() => seen(1),
            Some(count) if self.adc.transfers() => seen(count),
            _ => Time::NEVER,
        }
    }

    /// One cycle of the ADC clock.
    pub(crate) fn adc_cycle(&self) -> Time {
        times(self.clocks.pclk2_cycle(), self.adc_common.divider())
    }
}
