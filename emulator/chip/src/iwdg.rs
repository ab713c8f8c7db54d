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

/// Cycles of the LSI until a new prescaler or reload value is in force (RM0390 section 20.4.4). Until then the watchdog
/// counts and reloads with the old one.
const UPDATE_CYCLES: u64 = 5;

/// A register that the watchdog takes over in the clock of the LSI.
#[derive(Clone, Copy, Debug)]
struct Setting {
    value: u32,
    before: u32,
    /// The instant from which `value` is in force.
    since: Time,
}

impl Setting {
    const fn new(value: u32) -> Self {
        Self { value, before: value, since: Time::ZERO }
    }

    fn at(&self, now: Time) -> u32 {
        if now < self.since { self.before } else { self.value }
    }

    fn is_updating(&self, now: Time) -> bool {
        now < self.since
    }

    fn set(&mut self, value: u32, since: Time) {
        *self = Self { value, before: self.value, since };
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Iwdg {
    unlocked: bool,
    /// One cycle of the LSI of this chip.
    cycle: Time,
    prescaler: Setting,
    reload: Setting,
    /// While the watchdog runs: the count, and the instant of that count.
    count: Option<(u32, Time)>,
}

impl Iwdg {
    /// The watchdog of a chip whose LSI has this frequency in hertz.
    pub(crate) fn new(lsi: u32) -> Self {
        Self {
            unlocked: false,
            cycle: Time::of_cycle(lsi.into()),
            prescaler: Setting::new(0),
            reload: Setting::new(0xFFF),
            count: None,
        }
    }

    pub(crate) fn read(&self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            KR => Some(0),
            PR => Some(self.prescaler.value),
            RLR => Some(self.reload.value),
            SR => Some(flag(self.prescaler.is_updating(now), 0) | flag(self.reload.is_updating(now), 1)),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            KR => self.write_key(value & 0xFFFF, now),
            PR if self.unlocked && !self.prescaler.is_updating(now) => {
                self.count = self.count.map(|_| (self.value(now), now));
                self.prescaler.set(value & 7, now + self.update());
            }
            RLR if self.unlocked && !self.reload.is_updating(now) => {
                self.reload.set(value & 0xFFF, now + self.update());
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
            KEY_RELOAD if self.count.is_some() => self.count = Some((self.reload.at(now), now)),
            KEY_START if self.count.is_none() => self.count = Some((self.reload.at(now), now)),
            _ => {}
        }
    }

    /// Whether the watchdog was started; only a reset stops it.
    pub(crate) fn is_running(&self) -> bool {
        self.count.is_some()
    }

    fn update(&self) -> Time {
        Time(UPDATE_CYCLES * self.cycle.0)
    }

    fn tick(&self, prescaler: u32) -> u64 {
        self.cycle.0 << (2 + prescaler.min(6))
    }

    /// The ticks with the prescaler before from `since` to the update of the prescaler, and the instant of the update.
    fn before_update(&self, since: Time) -> (u64, Time) {
        let update = self.prescaler.since.max(since);
        (update.since(since).0 / self.tick(self.prescaler.before), update)
    }

    fn value(&self, now: Time) -> u32 {
        let Some((count, since)) = self.count else { return 0 };
        let (ticks, update) = self.before_update(since);
        let ticks = if now < update {
            now.since(since).0 / self.tick(self.prescaler.before)
        } else {
            ticks + now.since(update).0 / self.tick(self.prescaler.value)
        };
        count.saturating_sub(ticks as u32)
    }

    /// The instant at which the watchdog resets the chip. A count of 0 also lasts one tick (RM0390 section 20, table of
    /// time-outs).
    pub(crate) fn deadline(&self) -> Time {
        let Some((count, since)) = self.count else { return Time::NEVER };
        let (before, update) = self.before_update(since);
        match (u64::from(count) + 1).checked_sub(before) {
            Some(ticks) if ticks > 0 => update + Time(ticks * self.tick(self.prescaler.value)),
            _ => since + Time((u64::from(count) + 1) * self.tick(self.prescaler.before)),
        }
    }
}
