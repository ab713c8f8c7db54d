//! Virtual time of one core.

use canbus::Time;

/// The instant that the core has reached, and the length of its cycle.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    now: Time,
    cycle: Time,
    cycles: u64,
}

impl Clock {
    pub(crate) fn new(hertz: u64) -> Clock {
        Clock { now: Time::ZERO, cycle: Time::of_cycle(hertz), cycles: 0 }
    }

    pub(crate) fn now(&self) -> Time {
        self.now
    }

    /// The span of one cycle.
    pub(crate) fn cycle(&self) -> Time {
        self.cycle
    }

    /// Cycles that the core ran; sleeping does not count.
    pub(crate) fn cycles(&self) -> u64 {
        self.cycles
    }

    pub(crate) fn set_frequency(&mut self, hertz: u64) {
        self.cycle = Time::of_cycle(hertz);
    }

    /// The core works for this many cycles.
    pub(crate) fn run(&mut self, cycles: u32) {
        self.now += self.cycle * u64::from(cycles);
        self.cycles += u64::from(cycles);
    }

    /// The core waits until an instant; the span waited is the result.
    pub(crate) fn wait_until(&mut self, until: Time) -> Time {
        let waited = until.since(self.now);
        self.now += waited;
        waited
    }
}
