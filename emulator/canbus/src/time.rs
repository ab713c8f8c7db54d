//! Virtual time shared by the bus, the emulated boards and the clients.

use core::fmt;
use core::ops::{Add, AddAssign, Mul, Sub};

/// An instant or a span of virtual time: a count of 1/1008000 microseconds since power-on.
///
/// A cycle of every clock in the system is a whole number of units: 168 MHz is 6000, 144 MHz is 7000, the 16 MHz HSI is
/// 63000, the 32 kHz LSI is 31500000, a bit at 1 Mbit/s is 1008000. So boards with different clocks and the bus never
/// drift apart by rounding, and a clock that is some parts per million off is so in everything that it drives. 64 bits
/// last half a year.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(pub u64);

impl Time {
    /// Power-on.
    pub const ZERO: Time = Time(0);
    /// Later than any event.
    pub const NEVER: Time = Time(u64::MAX);
    /// Units in a microsecond.
    pub const PER_MICRO: u64 = 1_008_000;
    /// Units in a second.
    pub const PER_SECOND: u64 = Self::PER_MICRO * 1_000_000;

    /// The span of `n` microseconds.
    #[inline]
    pub const fn from_micros(n: u64) -> Time {
        Time(n * Self::PER_MICRO)
    }

    /// The span of `n` milliseconds.
    #[inline]
    pub const fn from_millis(n: u64) -> Time {
        Time(n * Self::PER_MICRO * 1_000)
    }

    /// The span of one cycle of a clock of `hertz`, rounded to the nearest unit (exact for the clocks above).
    ///
    /// # Panics
    /// When `hertz` is zero.
    #[inline]
    pub const fn of_cycle(hertz: u64) -> Time {
        Time((Self::PER_SECOND + hertz / 2) / hertz)
    }

    /// Whole microseconds.
    #[inline]
    pub const fn as_micros(self) -> u64 {
        self.0 / Self::PER_MICRO
    }

    /// Seconds, for display.
    #[allow(clippy::cast_precision_loss)]
    #[inline]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / Self::PER_SECOND as f64
    }

    /// The span from `earlier` to `self`, zero when `earlier` is later.
    #[inline]
    pub const fn since(self, earlier: Time) -> Time {
        Time(self.0.saturating_sub(earlier.0))
    }
}

impl Add for Time {
    type Output = Time;
    #[inline]
    fn add(self, span: Time) -> Time {
        Time(self.0.saturating_add(span.0))
    }
}

impl AddAssign for Time {
    #[inline]
    fn add_assign(&mut self, span: Time) {
        *self = *self + span;
    }
}

impl Sub for Time {
    type Output = Time;
    #[inline]
    fn sub(self, other: Time) -> Time {
        self.since(other)
    }
}

impl Mul<u64> for Time {
    type Output = Time;
    #[inline]
    fn mul(self, times: u64) -> Time {
        Time(self.0.saturating_mul(times))
    }
}

impl fmt::Display for Time {
    /// Seconds with microseconds, as candump prints them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micros = self.as_micros();
        write!(f, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)
    }
}
