//! Timers TIM2 to TIM7 and TIM9 to TIM14 (RM0390 sections 17 to 19, RM0090 sections 18 to 20).
//!
//! Modelled: up-counting, update and compare events, preloads, TRGO, encoder mode, input capture, the LSI at channel 4 of
//! TIM5, and the DMA requests of TIM3's update and channel 2. Not modelled: output pins, other DMA requests, counting down and the other slave
//! modes. A write that selects one of these is recorded.
//!
//! A compare matches when the counter changes to the compare value. A compare value equal to the current count
//! therefore matches only in the next round; a program must not rely on an immediate match.

mod capture;
mod counter;
mod encoder;

use canbus::Time;
use counter::{Counter, Shadow};

use crate::register::{bit, field, flag};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCMR2: u32 = 0x1C;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const CCR4: u32 = 0x40;
const OR: u32 = 0x50;

/// OR of TIM5: the input of channel 4 is the LSI (RM0390 section 17.4.21, TI4_RMP).
const OR_LSI: u32 = 1 << 6;

const CR1_CEN: u32 = 0;
const CR1_UDIS: u32 = 1;
const CR1_URS: u32 = 2;
const CR1_OPM: u32 = 3;
const CR1_ARPE: u32 = 7;
/// Unmodelled bits of CR1: DIR and CMS, counting down and up-down.
const CR1_DOWN: u32 = 0x0070;
/// Channel 4, as an index.
pub(crate) const LSI_CHANNEL: usize = 3;
const SR_UIF: u32 = 0;
/// Bits of DIER for interrupts: UIE, CC1IE to CC4IE, TIE; the higher bits enable DMA requests.
const DIER_INTERRUPTS: u32 = 0x005F;
/// UDE; CC1DE to CC4DE follow.
const DIER_UDE: u32 = 8;

/// The features of a timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    /// Whether the counter has 32 bits instead of 16.
    pub(crate) wide: bool,
    /// Capture and compare channels.
    pub(crate) channels: u32,
    /// The modelled DMA requests, as bits of DIER.
    pub(crate) requests: u32,
    /// Whether the LSI can be at channel 4.
    pub(crate) sees_lsi: bool,
}

/// One timer.
#[derive(Clone)]
pub(crate) struct Timer {
    kind: Kind,
    counter: Counter,
    compare: [Shadow; 4],
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    options: u32,
    /// Position of the encoder at the last update, in quarter periods; `None` without an encoder.
    position: Option<i64>,
    /// Whether the last motion of the encoder was backwards.
    backwards: bool,
    /// Whether an update event by software has sent TRGO.
    triggered: bool,
}

impl Timer {
    pub(crate) fn new(kind: Kind, cycle: Time) -> Self {
        let max = if kind.wide { u32::MAX } else { 0xFFFF };
        Self {
            kind,
            counter: Counter::new(cycle, max),
            compare: [Shadow::default(); 4],
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            options: 0,
            position: None,
            backwards: false,
            triggered: false,
        }
    }

    /// Changes the timer clock at `now`; the timer has been run up to `now`.
    pub(crate) fn set_cycle(&mut self, cycle: Time, now: Time) {
        self.counter.set_cycle(cycle, now);
    }

    /// Reads a register; `run` must come first.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            CR1 => Some(self.cr1 | flag(self.backwards && self.is_encoder(), 4)),
            CR2 => Some(self.cr2),
            DIER => Some(self.dier),
            SR => Some(self.sr),
            EGR => Some(0),
            CNT => Some(self.counter.value()),
            PSC => Some(self.counter.prescaler.preload),
            ARR => Some(self.counter.top.preload),
            _ if self.kind.channels == 0 => None,
            SMCR => Some(self.smcr),
            CCMR1 => Some(self.ccmr[0]),
            CCMR2 => Some(self.ccmr[1]),
            CCER => Some(self.ccer),
            OR if self.kind.sees_lsi => Some(self.options),
            CCR1..=CCR4 => self.channel_at(offset).map(|channel| self.compare[channel].preload),
            _ => None,
        }
    }

    /// Writes a register; `run` must come first. `None` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            CR1 => return self.write_control(value, now),
            CR2 => return self.write_master(value),
            DIER => return self.write_interrupts(value),
            // Software clears flags by writing 0 to them.
            SR => self.sr &= value,
            EGR => return self.generate(value, now),
            CNT => self.counter.set_value(value),
            PSC => self.counter.prescaler.write(value & 0xFFFF, true),
            ARR => self.counter.top.write(value & self.counter.max(), bit(self.cr1, CR1_ARPE)),
            _ if self.kind.channels == 0 => return None,
            SMCR => return self.write_slave(value, now),
            CCMR1 => self.write_modes(0, value),
            CCMR2 => self.write_modes(1, value),
            CCER => self.ccer = value & 0xBBBB,
            OR if self.kind.sees_lsi => return self.write_options(value),
            CCR1..=CCR4 => return self.write_compare(offset, value),
            _ => return None,
        }
        Some(())
    }

    fn write_control(&mut self, value: u32, now: Time) -> Option<()> {
        self.cr1 = value & 0x038F;
        self.counter.set_running(bit(value, CR1_CEN), now);
        let down = value & CR1_DOWN != 0 && !self.is_encoder();
        (!down).then_some(())
    }

    fn write_master(&mut self, value: u32) -> Option<()> {
        self.cr2 = value & 0x00F8;
        matches!(field(value, 4, 3), 0 | 2).then_some(())
    }

    fn write_slave(&mut self, value: u32, now: Time) -> Option<()> {
        self.smcr = value & 0xFFF7;
        self.counter.restart_tick(now);
        (field(value, 0, 3) <= 3).then_some(())
    }

    fn write_interrupts(&mut self, value: u32) -> Option<()> {
        self.dier = value & 0x5F5F;
        (value & !(DIER_INTERRUPTS | self.kind.requests) == 0).then_some(())
    }

    fn write_options(&mut self, value: u32) -> Option<()> {
        self.options = value & 0xC0;
        matches!(value, 0 | OR_LSI).then_some(())
    }

    /// Whether channel 4 captures edges of the LSI.
    pub(crate) fn measures_lsi(&self) -> bool {
        self.options == OR_LSI && self.listens(LSI_CHANNEL)
    }

    /// CCxS keeps its value while the channel is on (RM0390 section 17.4.7).
    fn write_modes(&mut self, register: usize, value: u32) {
        let is_on = |channel: usize| bit(self.ccer, (2 * register + channel) as u32 * 4);
        let kept = if is_on(0) { 0x0003 } else { 0 } | if is_on(1) { 0x0300 } else { 0 };
        self.ccmr[register] = value & 0xFFFF & !kept | self.ccmr[register] & kept;
    }

    fn write_compare(&mut self, offset: u32, value: u32) -> Option<()> {
        let channel = self.channel_at(offset)?;
        // The register of an input channel is read-only.
        if !self.is_input(channel) {
            let buffered = bit(self.mode(channel), 3);
            self.compare[channel].write(value & self.counter.max(), buffered);
        }
        Some(())
    }

    fn channel_at(&self, offset: u32) -> Option<usize> {
        let channel = (offset - CCR1) / 4;
        (offset.is_multiple_of(4) && channel < self.kind.channels).then_some(channel as usize)
    }

    /// The channel's eight bits of CCMR.
    fn mode(&self, channel: usize) -> u32 {
        field(self.ccmr[channel / 2], channel as u32 % 2 * 8, 8)
    }

    fn is_input(&self, channel: usize) -> bool {
        field(self.mode(channel), 0, 2) != 0
    }

    /// Events by software: UG, CC1G to CC4G.
    fn generate(&mut self, value: u32, now: Time) -> Option<()> {
        if bit(value, 0) {
            self.counter.clear(now);
            self.update_event(bit(self.cr1, CR1_URS));
            self.triggered |= matches!(field(self.cr2, 4, 3), 0 | 2);
        }
        self.sr |= value & 0x1E;
        (value & !0x1F == 0).then_some(())
    }

    /// Activates the preloads and sets UIF unless `silent`.
    fn update_event(&mut self, silent: bool) {
        if bit(self.cr1, CR1_UDIS) {
            return;
        }
        self.counter.load();
        self.compare.iter_mut().for_each(Shadow::load);
        self.sr |= flag(!silent, SR_UIF);
    }

    /// Counts up to `now`. `position` is the position of the encoder on inputs 1 and 2, in quarter periods; `None`
    /// without an encoder.
    pub(crate) fn run(&mut self, now: Time, position: Option<i64>) {
        if self.is_encoder() {
            self.follow(position);
        } else {
            self.count(now);
        }
        self.position = position;
    }

    fn count(&mut self, now: Time) {
        let run = self.counter.run_in_period(now);
        self.match_channels(|value| run.reached(value));
        if !self.counter.run_over(now) {
            return;
        }
        self.update_event(false);
        let top = self.counter.top.active;
        self.match_channels(|value| value == 0 || value > top);
        if bit(self.cr1, CR1_OPM) {
            self.cr1 &= !(1 << CR1_CEN);
            self.counter.set_running(false, now);
            return;
        }
        let run = self.counter.run_on(now);
        self.match_channels(|value| run.reached(value));
        if run.reached(0) {
            self.update_event(false);
        }
    }

    /// Sets CCxIF of the output channels whose compare value was reached.
    fn match_channels(&mut self, reached: impl Fn(u32) -> bool) {
        for channel in 0..self.kind.channels as usize {
            let hit = !self.is_input(channel) && reached(self.compare[channel].active);
            self.sr |= flag(hit, channel as u32 + 1);
        }
    }

    /// The flags of the channels.
    pub(crate) fn matches(&self) -> u32 {
        self.sr & 0x1E
    }

    /// Clears the flag of a channel, 1 to 4.
    pub(crate) fn forget_match(&mut self, channel: u32) {
        self.sr &= !(1 << channel);
    }

    /// Whether an interrupt is enabled and its flag is not set.
    fn awaits(&self, flag_bit: u32) -> bool {
        bit(self.dier & !self.sr, flag_bit)
    }

    fn awaited_channels(&self) -> impl Iterator<Item = usize> {
        let channels = 0..self.kind.channels as usize;
        channels.filter(|&channel| self.awaits(channel as u32 + 1) && !self.is_input(channel))
    }

    /// The instant of the next interrupt that is not pending yet, or an earlier instant, but never a later one. Never
    /// in encoder mode.
    pub(crate) fn deadline(&self) -> Time {
        if self.is_encoder() {
            return Time::NEVER;
        }
        let update = if self.awaits(SR_UIF) { self.counter.overflow() } else { Time::NEVER };
        let compare = |channel: usize| {
            let Shadow { preload, active } = self.compare[channel];
            self.counter.reaches(active).min(if preload == active {
                Time::NEVER
            } else {
                self.counter.overflow()
            })
        };
        self.awaited_channels().map(compare).fold(update, Time::min)
    }

    /// Whether an update event requests DMA.
    pub(crate) fn requests_on_update(&self) -> bool {
        bit(self.dier, DIER_UDE)
    }

    /// The instant of the next TRGO, and the shortest span to the following one.
    pub(crate) fn trigger_output(&self) -> (Time, Time) {
        let next = match field(self.cr2, 4, 3) {
            2 if !bit(self.cr1, CR1_UDIS) => self.counter.overflow(),
            _ => Time::NEVER,
        };
        (next, self.counter.period())
    }

    /// Whether an update event by software sent TRGO since the last call.
    pub(crate) fn take_trigger(&mut self) -> bool {
        std::mem::take(&mut self.triggered)
    }

    /// The level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        self.sr & self.dier & DIER_INTERRUPTS != 0
    }
}
