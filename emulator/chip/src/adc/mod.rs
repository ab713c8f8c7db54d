//! ADC1: regular conversions (RM0390 section 13, RM0090 section 13).
//!
//! Modelled: scan, single and continuous mode, software and timer trigger, DMA with DDS, overrun, every sample time and
//! resolution. Not modelled: injected and discontinuous conversions and the analogue watchdog. A write that selects one
//! of these is recorded.

mod common;
mod sequence;

use canbus::Time;
pub(crate) use common::AdcCommon;
use sequence::Sequence;

use crate::clocks::times;
use crate::register::{Plain, RegisterFile, bit, field, flag};

const SR: u32 = 0x00;
const CR1: u32 = 0x04;
const CR2: u32 = 0x08;
const SMPR1: u32 = 0x0C;
const SMPR2: u32 = 0x10;
const SQR1: u32 = 0x2C;
const SQR3: u32 = 0x34;
const DR: u32 = 0x4C;

/// Thresholds of the analogue watchdog: the values are stored, but the watchdog cannot be turned on.
const PLAIN: &[Plain] = &[Plain::new(0x24, 0x0FFF, 0x0FFF), Plain::new(0x28, 0, 0x0FFF)];

const EOC: u32 = 1;
const STRT: u32 = 4;
const OVR: u32 = 5;
/// Bits of CR1 that are modelled: EOCIE, SCAN, RES, OVRIE, and AWDCH, which has no effect alone.
const CR1_MODELLED: u32 = 0x1F | 1 << 5 | 1 << 8 | 3 << 24 | 1 << 26;
/// Bits of CR2 that are modelled: all but JEXTEN and JSWSTART.
const CR2_MODELLED: u32 = 0x7F0F_0F03;
/// tSTAB of DS10693: 3 us at most.
pub(crate) const STABILISATION: Time = Time::from_micros(3);
/// Regular trigger conversion latency, tlatr of DS10693: 2 cycles of the ADC clock.
const TRIGGER_LATENCY: u32 = 2;

/// A timer whose TRGO starts conversions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trigger {
    Tim2,
    Tim3,
}

/// A conversion under way.
#[derive(Clone, Copy, Debug)]
struct Conversion {
    rank: usize,
    /// The end of the sample time: the voltage of this instant is converted.
    sampled: Time,
    end: Time,
}

/// A sampled channel that waits for its converted value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) channel: u32,
    pub(crate) at: Time,
}

#[derive(Clone)]
pub(crate) struct Adc {
    plain: RegisterFile,
    sequence: Sequence,
    /// One cycle of the ADC clock.
    cycle: Time,
    sr: u32,
    cr1: u32,
    cr2: u32,
    dr: u32,
    /// The end of the stabilisation time after ADON.
    stable: Time,
    /// The time from ADON to a start before the end of that time.
    early_start: Option<Time>,
    conversion: Option<Conversion>,
    /// DR has a value that has not been read.
    unread: bool,
    /// A DMA request is pending.
    request: bool,
    /// The stream has made its last transfer and DDS is 0: no more requests.
    exhausted: bool,
}

impl Adc {
    pub(crate) fn new(cycle: Time) -> Self {
        Self {
            plain: RegisterFile::new(PLAIN),
            sequence: Sequence::default(),
            cycle,
            sr: 0,
            cr1: 0,
            cr2: 0,
            dr: 0,
            stable: Time::NEVER,
            early_start: None,
            conversion: None,
            unread: false,
            request: false,
            exhausted: false,
        }
    }

    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.cycle);
    }

    pub(crate) fn set_cycle(&mut self, cycle: Time) {
        self.cycle = cycle;
    }

    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        match offset {
            SR => Some(self.sr),
            CR1 => Some(self.cr1),
            CR2 => Some(self.cr2),
            DR => Some(self.take()),
            SMPR1 | SMPR2 | SQR1..=SQR3 => self.sequence.read(offset),
            _ => self.plain.read(offset),
        }
    }

    /// `None` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            SR => {
                // Software clears flags by writing 0. Clearing OVR discards the value that an overrun left in DR.
                self.unread &= !bit(self.sr & !value, OVR);
                self.sr &= value;
                Some(())
            }
            CR1 => {
                self.cr1 = value & 0x07C0_FFFF;
                (value & !CR1_MODELLED == 0).then_some(())
            }
            CR2 => self.write_control(value, now),
            SMPR1 | SMPR2 | SQR1..=SQR3 => self.sequence.write(offset, value),
            _ => self.plain.write(offset, value),
        }
    }

    fn write_control(&mut self, value: u32, now: Time) -> Option<()> {
        if bit(value, 0) && !self.is_on() {
            self.stable = now + STABILISATION;
        }
        // Writing 0 and then 1 to the DMA bit enables requests again after the last transfer or an overrun.
        if !self.uses_dma() || !bit(value, 8) {
            self.exhausted = false;
        }
        self.cr2 = value & 0x3F3F_0F03;
        if !self.is_on() {
            self.conversion = None;
        } else if bit(value, 30) {
            self.start(now);
        }
        let known_trigger = field(value, 28, 2) == 0 || self.trigger().is_some();
        (value & !CR2_MODELLED == 0 && known_trigger).then_some(())
    }

    /// Reads DR.
    fn take(&mut self) -> u32 {
        self.unread = false;
        self.sr &= !(1 << EOC);
        self.dr
    }

    fn is_on(&self) -> bool {
        bit(self.cr2, 0)
    }

    fn is_continuous(&self) -> bool {
        bit(self.cr2, 1)
    }

    fn uses_dma(&self) -> bool {
        bit(self.cr2, 8)
    }

    /// The timer that starts conversions (EXTSEL, RM0390 section 13.13.3).
    pub(crate) fn trigger(&self) -> Option<Trigger> {
        match (field(self.cr2, 28, 2), field(self.cr2, 24, 4)) {
            (1.., 6) if self.is_on() => Some(Trigger::Tim2),
            (1.., 8) if self.is_on() => Some(Trigger::Tim3),
            _ => None,
        }
    }

    /// A trigger event. During a sequence the trigger is ignored.
    pub(crate) fn on_trigger(&mut self, at: Time) {
        self.start(at + times(self.cycle, TRIGGER_LATENCY));
    }

    fn start(&mut self, at: Time) {
        if self.conversion.is_none() {
            if at < self.stable {
                self.early_start = Some(STABILISATION - (self.stable - at));
            }
            self.sr |= 1 << STRT;
            self.convert(0, at.max(self.stable));
        }
    }

    /// Takes the time from ADON to a start before the ADC was stable, if there was one.
    pub(crate) fn take_early_start(&mut self) -> Option<Time> {
        self.early_start.take()
    }

    fn convert(&mut self, rank: usize, from: Time) {
        let sampled = from + times(self.cycle, self.sequence.sample_cycles(rank));
        let end = sampled + times(self.cycle, self.bits());
        self.conversion = Some(Conversion { rank, sampled, end });
    }

    /// The resolution, which is also the number of cycles of a conversion after its sample time.
    fn bits(&self) -> u32 {
        12 - 2 * field(self.cr1, 24, 2)
    }

    /// Conversions in a sequence.
    fn length(&self) -> usize {
        let scan = bit(self.cr1, 8);
        if scan { self.sequence.length() } else { 1 }
    }

    /// The channels of the sequence, each with its sample time.
    pub(crate) fn sampling(&self) -> Vec<(u32, Time)> {
        let time = |rank| times(self.cycle, self.sequence.sample_cycles(rank));
        (0..self.length()).map(|rank| (self.sequence.channel(rank), time(rank))).collect()
    }

    /// The end of the conversion under way.
    pub(crate) fn conversion_end(&self) -> Time {
        self.conversion.map_or(Time::NEVER, |conversion| conversion.end)
    }

    /// The channel and the instant of the conversion under way.
    pub(crate) fn sample(&self) -> Option<Sample> {
        let conversion = self.conversion?;
        Some(Sample { channel: self.sequence.channel(conversion.rank), at: conversion.sampled })
    }

    /// Ends the conversion under way with a 12-bit code, and continues the sequence.
    pub(crate) fn finish(&mut self, code: u32) {
        let Some(conversion) = self.conversion.take() else { return };
        let last = conversion.rank + 1 >= self.length();
        self.deliver(code, last);
        if !last {
            self.convert(conversion.rank + 1, conversion.end);
        } else if self.is_continuous() {
            self.convert(0, conversion.end);
        }
    }

    fn deliver(&mut self, code: u32, last: bool) {
        let each = bit(self.cr2, 10);
        if self.unread && (self.uses_dma() || each) {
            // Overrun: the old value stays and DMA requests stop until OVR is cleared.
            self.sr |= 1 << OVR;
        }
        if bit(self.sr, OVR) {
            return;
        }
        let left = bit(self.cr2, 11);
        self.dr = code >> (12 - self.bits()) << if left { 16 - self.bits() } else { 0 };
        self.unread = true;
        self.sr |= flag(each || last, EOC);
        self.request = self.uses_dma() && !self.exhausted;
    }

    /// Whether a DMA request is pending.
    pub(crate) fn requests(&self) -> bool {
        self.request
    }

    /// The DMA request was served; `last` for the last transfer of the stream.
    pub(crate) fn served(&mut self, last: bool) {
        self.request = false;
        let keeps_on = bit(self.cr2, 9);
        self.exhausted = last && !keeps_on;
    }

    /// The end of the `count`th conversion from now on, or an earlier instant, but never a later one. `trigger` is the
    /// instant of the next trigger and the shortest span to the following one.
    pub(crate) fn end_after(&self, count: usize, trigger: (Time, Time)) -> Time {
        let Some(current) = self.conversion else { return self.end_from_trigger(count, trigger) };
        let in_sequence = self.length() - current.rank.min(self.length() - 1);
        if count <= in_sequence {
            current.end + self.span(current.rank + 1, count - 1)
        } else if self.is_continuous() {
            current.end + self.span(current.rank + 1, in_sequence - 1)
        } else {
            self.end_from_trigger(count - in_sequence, trigger)
        }
    }

    fn end_from_trigger(&self, count: usize, (next, period): (Time, Time)) -> Time {
        let sequences = (count - 1) / self.length();
        let rest = (count - 1) % self.length() + 1;
        let start = Time(next.0.saturating_add(period.0.saturating_mul(sequences as u64)));
        start + times(self.cycle, TRIGGER_LATENCY) + self.span(0, rest)
    }

    /// The duration of `count` conversions from `rank` on.
    fn span(&self, rank: usize, count: usize) -> Time {
        let cycles = (rank..rank + count).map(|rank| self.sequence.sample_cycles(rank) + self.bits());
        times(self.cycle, cycles.sum())
    }

    /// Whether the end of a conversion can raise the interrupt.
    pub(crate) fn awaits_interrupt(&self) -> bool {
        bit(self.cr1, 5) && !bit(self.sr, EOC) || bit(self.cr1, 26) && !bit(self.sr, OVR)
    }

    /// Whether conversions end with a DMA transfer.
    pub(crate) fn transfers(&self) -> bool {
        self.uses_dma() && !self.exhausted && !bit(self.sr, OVR)
    }

    /// The flags as the common status register shows them.
    pub(crate) fn status(&self) -> u32 {
        self.sr & 0x3F
    }

    /// The level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        bit(self.sr, EOC) && bit(self.cr1, 5) || bit(self.sr, OVR) && bit(self.cr1, 26)
    }
}
