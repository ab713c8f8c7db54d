//! SysTick, a 24-bit down counter of the core clock or an eighth of it (ARMv7-M ARM, B3.3).

use canbus::Time;

const ENABLE: u32 = 1;
const TICKINT: u32 = 1 << 1;
const CLKSOURCE: u32 = 1 << 2;
const COUNTFLAG: u32 = 1 << 16;
const MASK: u32 = 0x00FF_FFFF;

/// The counter. Its value is not stored but follows from the instant at which it next reaches zero.
pub(crate) struct SysTick {
    control: u32,
    reload: u32,
    counted: bool,
    /// One core cycle.
    cycle: Time,
    /// The counter's value while it stands.
    held: u32,
    /// When the running counter reaches zero.
    zero: Time,
}

impl SysTick {
    pub(crate) fn new(cycle: Time) -> SysTick {
        SysTick { control: 0, reload: 0, counted: false, cycle, held: 0, zero: Time::NEVER }
    }

    /// The next instant at which the counter reaches zero.
    pub(crate) fn deadline(&self) -> Time {
        self.zero
    }

    /// Lets the counter pass zero at `now`, its deadline; whether the exception becomes pending.
    pub(crate) fn expire(&mut self, now: Time) -> bool {
        self.counted = true;
        self.zero =
            if self.reload == 0 { Time::NEVER } else { now + self.tick() * (u64::from(self.reload) + 1) };
        self.control & TICKINT != 0
    }

    /// The core clock changed at `now`.
    pub(crate) fn set_cycle(&mut self, cycle: Time, now: Time) {
        self.pause(now);
        self.cycle = cycle;
        self.resume(now);
    }

    pub(crate) fn read(&mut self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            0x0 => {
                let flag = if std::mem::take(&mut self.counted) { COUNTFLAG } else { 0 };
                Some(self.control | flag)
            }
            0x4 => Some(self.reload),
            0x8 => Some(self.value(now)),
            // CALIB: HCLK / 8 is the reference; one millisecond is not told exactly (PM0214, section 4.5.4).
            0xC => Some(1 << 30),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        self.pause(now);
        match offset {
            0x0 => self.control = value & (ENABLE | TICKINT | CLKSOURCE),
            0x4 => self.reload = value & MASK,
            0x8 => {
                self.held = 0;
                self.counted = false;
            }
            0xC => {}
            _ => return None,
        }
        self.resume(now);
        Some(())
    }

    /// The span of one count.
    fn tick(&self) -> Time {
        if self.control & CLKSOURCE != 0 { self.cycle } else { self.cycle * 8 }
    }

    fn value(&self, now: Time) -> u32 {
        match self.zero {
            Time::NEVER => self.held,
            zero => {
                let counts = zero.since(now).0.div_ceil(self.tick().0) as u32;
                if counts > self.reload { 0 } else { counts }
            }
        }
    }

    fn pause(&mut self, now: Time) {
        self.held = self.value(now);
        self.zero = Time::NEVER;
    }

    /// Counting on from zero loads the reload value first, which takes one count and sets no flag.
    fn resume(&mut self, now: Time) {
        let counts = if self.held == 0 { self.reload + u32::from(self.reload != 0) } else { self.held };
        if self.control & ENABLE != 0 && counts != 0 {
            self.zero = now + self.tick() * u64::from(counts);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn period_is_reload_plus_one() {
        let mut tick = SysTick::new(Time(70));
        tick.write(4, 99, Time::ZERO);
        tick.write(8, 0, Time::ZERO);
        tick.write(0, ENABLE | TICKINT | CLKSOURCE, Time::ZERO);
        assert_eq!(tick.deadline(), Time(70 * 100));
        assert!(tick.expire(Time(7000)));
        assert_eq!(tick.deadline(), Time(70 * 200));
        assert_eq!(tick.read(8, Time(7000)), Some(0));
        assert_eq!(tick.read(8, Time(7070)), Some(99));
        assert_eq!(tick.read(8, Time(7140)), Some(98));
        assert_eq!(tick.read(0, Time(7140)).map(|value| value & COUNTFLAG), Some(COUNTFLAG));
        assert_eq!(tick.read(0, Time(7140)).map(|value| value & COUNTFLAG), Some(0));
    }

    #[test]
    fn a_clock_change_keeps_the_count() {
        let mut tick = SysTick::new(Time(630));
        tick.write(4, 999, Time::ZERO);
        tick.write(0, ENABLE | CLKSOURCE, Time::ZERO);
        let half = Time(630 * 500);
        tick.set_cycle(Time(70), half);
        assert_eq!(tick.deadline(), half + Time(70 * 500));
    }

    #[test]
    fn the_external_clock_is_an_eighth() {
        let mut tick = SysTick::new(Time(70));
        tick.write(4, 9, Time::ZERO);
        tick.write(0, ENABLE, Time::ZERO);
        assert_eq!(tick.deadline(), Time(70 * 8 * 10));
    }
}
