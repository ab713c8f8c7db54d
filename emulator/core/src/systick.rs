//! SysTick, the 24-bit timer of the core (ARMv7-M, B3.3). The count is computed from virtual time.

use canbus::Time;

const ENABLE: u32 = 1 << 0;
const TICKINT: u32 = 1 << 1;
const CLKSOURCE: u32 = 1 << 2;
const COUNTFLAG: u32 = 1 << 16;

/// The timer; one tick after zero it wraps to the reload value.
#[derive(Clone, Debug, Default)]
pub(crate) struct SysTick {
    control: u32,
    reload: u32,
    flag: bool,
    /// The value while the timer is stopped.
    held: u32,
    /// The instant of the next change from 1 to 0, while the timer runs.
    zero: Time,
    tick: Time,
}

impl SysTick {
    /// The instant of the next event; [`Time::NEVER`] when the timer is stopped.
    pub(crate) fn deadline(&self) -> Time {
        if self.runs() { self.zero } else { Time::NEVER }
    }

    /// Advances to `now`; `true` when the exception becomes pending.
    pub(crate) fn advance(&mut self, now: Time) -> bool {
        let mut pend = false;
        while self.runs() && self.zero <= now {
            self.flag = true;
            pend |= self.control & TICKINT != 0;
            self.zero += self.period();
        }
        pend
    }

    pub(crate) fn read(&mut self, offset: u32, now: Time) -> u32 {
        match offset {
            0x0 => self.control | if std::mem::take(&mut self.flag) { COUNTFLAG } else { 0 },
            0x4 => self.reload,
            0x8 => self.count(now),
            // No reference clock calibration: NOREF is 0, SKEW 1, TENMS unknown.
            _ => 1 << 30,
        }
    }

    /// Writes a register; `cycle` is the current length of a core cycle.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time, cycle: Time) {
        let count = self.count(now);
        match offset {
            0x0 => self.control = value & (ENABLE | TICKINT | CLKSOURCE),
            0x4 => self.reload = value & 0x00FF_FFFF,
            0x8 => self.flag = false,
            _ => return,
        }
        self.set_cycle(cycle);
        self.go_on(if offset == 0x8 { 0 } else { count }, now);
    }

    /// The core clock has changed; the count keeps its value.
    pub(crate) fn change_clock(&mut self, now: Time, cycle: Time) {
        let count = self.count(now);
        self.set_cycle(cycle);
        self.go_on(count, now);
    }

    /// The external reference clock of the STM32F4 is HCLK / 8 (RM0390, 10.1).
    fn set_cycle(&mut self, cycle: Time) {
        self.tick = if self.control & CLKSOURCE == 0 { Time(cycle.0 * 8) } else { cycle };
    }

    /// Continues from `count`. A count of zero is reloaded at the next tick.
    fn go_on(&mut self, count: u32, now: Time) {
        self.held = count;
        let ticks = if count == 0 { u64::from(self.reload) + 1 } else { count.into() };
        self.zero = now + Time(self.tick.0 * ticks);
    }

    fn runs(&self) -> bool {
        self.control & ENABLE != 0 && self.reload != 0
    }

    fn period(&self) -> Time {
        Time(self.tick.0 * (u64::from(self.reload) + 1))
    }

    fn count(&self, now: Time) -> u32 {
        if !self.runs() {
            return self.held;
        }
        let left = self.zero.since(now).0.div_ceil(self.tick.0.max(1)) as u32;
        // Before its first tick the count is still zero.
        if left > self.reload.max(self.held) { 0 } else { left }
    }
}
