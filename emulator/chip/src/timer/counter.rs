//! The time base of a timer: prescaler, counter and auto-reload register. The value is computed on demand, never
//! stepped.

use canbus::Time;

/// A register with a preload: the hardware works with `active`, software writes `preload`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Shadow {
    pub(super) preload: u32,
    pub(super) active: u32,
}

impl Shadow {
    const fn new(value: u32) -> Self {
        Self { preload: value, active: value }
    }

    /// A write by software; without `buffered` it takes effect at once.
    pub(super) fn write(&mut self, value: u32, buffered: bool) {
        self.preload = value;
        if !buffered {
            self.active = value;
        }
    }

    pub(super) fn load(&mut self) {
        self.active = self.preload;
    }

    fn is_loaded(self) -> bool {
        self.active == self.preload
    }
}

/// A run of the counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// The value before the run.
    pub(super) from: u32,
    /// Steps made; the last one may be an overflow to 0.
    pub(super) ticks: u64,
    /// Number of values in the cycle of the counter.
    pub(super) modulus: u64,
}

impl Run {
    /// Whether the counter reached `value` in the run (the start value does not count). A value above the top counts as
    /// reached at the overflow (RM0390 section 17.4.5, CC1IF).
    pub(super) fn reached(&self, value: u32) -> bool {
        let value = u64::from(value);
        let goal = if value < self.modulus { value } else { 0 };
        let from = u64::from(self.from) % self.modulus;
        let distance = (goal + self.modulus - from) % self.modulus;
        (if distance == 0 { self.modulus } else { distance }) <= self.ticks
    }
}

/// An up-counter.
#[derive(Clone, Debug)]
pub(super) struct Counter {
    /// One cycle of the timer clock.
    cycle: Time,
    /// The largest value: FFFFh or FFFF FFFFh.
    max: u32,
    value: u32,
    /// While the counter runs: the instant at which it reached its value. While it is stopped: the age of the value.
    since: Time,
    running: bool,
    pub(super) prescaler: Shadow,
    pub(super) top: Shadow,
}

impl Counter {
    pub(super) fn new(cycle: Time, max: u32) -> Self {
        Self {
            cycle,
            max,
            value: 0,
            since: Time::ZERO,
            running: false,
            prescaler: Shadow::default(),
            top: Shadow::new(max),
        }
    }

    /// The largest value of the counter.
    pub(super) fn max(&self) -> u32 {
        self.max
    }

    /// The value at the last call of `run`.
    pub(super) fn value(&self) -> u32 {
        self.value
    }

    pub(super) fn running(&self) -> bool {
        self.running
    }

    pub(super) fn set_running(&mut self, running: bool, now: Time) {
        if running != self.running {
            self.since = now - self.since;
            self.running = running;
        }
    }

    /// Changes the timer clock; the elapsed part of a tick is discarded.
    pub(super) fn set_cycle(&mut self, cycle: Time, now: Time) {
        if cycle != self.cycle {
            self.cycle = cycle;
            self.restart_tick(now);
        }
    }

    pub(super) fn set_value(&mut self, value: u32) {
        self.value = value & self.max;
    }

    /// Restarts from 0 and resets the prescaler (an update event by software).
    pub(super) fn clear(&mut self, now: Time) {
        self.value = 0;
        self.restart_tick(now);
    }

    /// Resets the prescaler.
    pub(super) fn restart_tick(&mut self, now: Time) {
        self.since = if self.running { now } else { Time::ZERO };
    }

    /// Activates the preloaded values (an update event).
    pub(super) fn load(&mut self) {
        self.prescaler.load();
        self.top.load();
    }

    fn tick(&self) -> u64 {
        self.cycle.0 * (u64::from(self.prescaler.active) + 1)
    }

    /// A null auto-reload value blocks the counter (RM0390 section 17.3.1, TIMx_ARR).
    fn counts(&self) -> bool {
        self.running && self.top.active != 0
    }

    fn modulus(&self) -> u64 {
        u64::from(self.top.active) + 1
    }

    /// Ticks until the next overflow; a counter above its top runs through its whole width.
    fn ticks_to_overflow(&self) -> u64 {
        let top = if self.value > self.top.active { self.max } else { self.top.active };
        u64::from(top - self.value) + 1
    }

    /// The instant of the next overflow.
    pub(super) fn overflow(&self) -> Time {
        self.after(self.ticks_to_overflow())
    }

    fn after(&self, ticks: u64) -> Time {
        if self.counts() {
            Time(self.since.0.saturating_add(ticks.saturating_mul(self.tick())))
        } else {
            Time::NEVER
        }
    }

    /// The length of a cycle of the counter, or of the next cycle if a pending load makes that one shorter.
    pub(super) fn period(&self) -> Time {
        let length = |prescaler, top| self.cycle.0 * (u64::from(prescaler) + 1) * (u64::from(top) + 1);
        let now = length(self.prescaler.active, self.top.active);
        Time(now.min(length(self.prescaler.preload, self.top.preload)))
    }

    /// The instant at which the counter next reaches `value`, or an earlier instant at which the caller must ask again.
    pub(super) fn reaches(&self, value: u32) -> Time {
        if value > self.value && value <= self.top.active {
            self.after(u64::from(value - self.value))
        } else if value <= self.top.active && self.top.is_loaded() && self.prescaler.is_loaded() {
            self.after(self.ticks_to_overflow() + u64::from(value))
        } else {
            self.overflow()
        }
    }

    /// Counts up to `now`, but not over an overflow.
    pub(super) fn run_in_period(&mut self, now: Time) -> Run {
        let ticks = self.elapsed(now).min(self.ticks_to_overflow() - 1);
        self.go(ticks, u64::from(self.max) + 1)
    }

    /// Carries out an overflow that is due at `now`.
    pub(super) fn run_over(&mut self, now: Time) -> bool {
        let due = self.overflow() <= now;
        if due {
            self.since = self.overflow();
            self.value = 0;
        }
        due
    }

    /// Counts up to `now` over any number of overflows.
    pub(super) fn run_on(&mut self, now: Time) -> Run {
        self.go(self.elapsed(now), self.modulus())
    }

    fn elapsed(&self, now: Time) -> u64 {
        if self.counts() { now.since(self.since).0 / self.tick() } else { 0 }
    }

    fn go(&mut self, ticks: u64, modulus: u64) -> Run {
        let run = Run { from: self.value, ticks, modulus };
        self.since += Time(ticks * self.tick());
        self.value = ((u64::from(self.value) + ticks) % modulus) as u32;
        run
    }

    /// Moves by `steps` of an encoder, in either direction; the run is described in the direction of the motion.
    pub(super) fn turn(&mut self, steps: i64) -> Turn {
        if !self.counts() {
            return Turn { run: Run { from: self.value, ticks: 0, modulus: self.modulus() }, wrapped: false };
        }
        let turn = self.look(steps);
        let modulus = self.modulus() as i64;
        self.value = (i64::from(self.value) + steps).rem_euclid(modulus) as u32;
        turn
    }

    /// The result of `turn`, without the move.
    pub(super) fn look(&self, steps: i64) -> Turn {
        let modulus = self.modulus() as i64;
        let wrapped = !(0..modulus).contains(&(i64::from(self.value) + steps));
        Turn { run: Run { from: self.value, ticks: steps.unsigned_abs(), modulus: self.modulus() }, wrapped }
    }
}

/// A move of an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    run: Run,
    /// The counter passed its top or 0.
    pub(super) wrapped: bool,
}

impl Turn {
    /// Whether the move passed a value, forwards or backwards.
    pub(super) fn reached(&self, value: u32, forwards: bool) -> bool {
        if forwards {
            return self.run.reached(value);
        }
        // A backward run is a forward run with all values mirrored.
        let mirror =
            |value: u32| ((self.run.modulus - u64::from(value) % self.run.modulus) % self.run.modulus) as u32;
        u64::from(value) < self.run.modulus
            && Run { from: mirror(self.run.from), ..self.run }.reached(mirror(value))
    }
}
