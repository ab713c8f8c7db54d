//! IWDG: the independent watchdog (RM0390 section 20, RM0090 section 21).

use canbus::Time;

use crate::register::flag;

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

const KEY_RELOAD: u32 = 0xAAAA;
const KEY_UNLOCK: u32 = 0x5555;
const KEY_START: u32 = 0xCCCC;

/// One cycle of the LSI at its nominal 32 kHz.
const LSI_CYCLE: Time = Time::of_cycle(32_000);
/// A new prescaler or reload value arrives within five cycles of the LSI (RM0390 section 20.4.4).
const UPDATE: Time = Time(5 * LSI_CYCLE.0);

#[derive(Clone, Debug)]
pub(crate) struct Iwdg {
    unlocked: bool,
    prescaler: u32,
    reload: u32,
    prescaler_ready: Time,
    reload_ready: Time,
    /// While the watchdog runs: the count, and the instant of that count.
    count: Option<(u32, Time)>,
}

impl Iwdg {
    pub(crate) fn new() -> Self {
        Self {
            unlocked: false,
            prescaler: 0,
            reload: 0xFFF,
            prescaler_ready: Time::ZERO,
            reload_ready: Time::ZERO,
            count: None,
        }
    }

    pub(crate) fn read(&self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            KR => Some(0),
            PR => Some(self.prescaler),
            RLR => Some(self.reload),
            SR => Some(flag(now < self.prescaler_ready, 0) | flag(now < self.reload_ready, 1)),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            KR => self.write_key(value & 0xFFFF, now),
            PR if self.unlocked && now >= self.prescaler_ready => {
                self.count = self.count.map(|_| (self.value(now), now));
                self.prescaler = value & 7;
                self.prescaler_ready = now + UPDATE;
            }
            RLR if self.unlocked && now >= self.reload_ready => {
                self.reload = value & 0xFFF;
                self.reload_ready = now + UPDATE;
            }
            // The registers are locked, or an update is under way: the write is lost.
            PR | RLR | SR => {}
            _ => return None,
        }
        Some(())
    }

    fn write_key(&mut self, key: u32, now: Time) {
        self.unlocked = key == KEY_UNLOCK;
        match key {
            KEY_RELOAD if self.count.is_some() => self.count = Some((self.reload, now)),
            KEY_START if self.count.is_none() => self.count = Some((self.reload, now)),
            _ => {}
        }
    }

    /// Whether the watchdog was started; only a reset stops it.
    pub(crate) fn is_running(&self) -> bool {
        self.count.is_some()
    }

    fn tick(&self) -> u64 {
        LSI_CYCLE.0 << (2 + self.prescaler.min(6))
    }

    fn value(&self, now: Time) -> u32 {
        let Some((count, since)) = self.count else { return 0 };
        count.saturating_sub((now.since(since).0 / self.tick()) as u32)
    }

    /// The instant at which the watchdog resets the chip. A count of 0 also lasts one tick (RM0390 section 20, table of
    /// time-outs).
    pub(crate) fn deadline(&self) -> Time {
        self.count.map_or(Time::NEVER, |(count, since)| since + Time((u64::from(count) + 1) * self.tick()))
    }
}
