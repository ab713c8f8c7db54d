//! Time in microseconds. The caller passes the time to every call; this crate reads no clock.

use core::ops::Add;

/// A time span in microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration(pub u64);

impl Duration {
    /// `n` milliseconds.
    #[must_use]
    pub const fn from_millis(n: u64) -> Duration {
        Duration(n.saturating_mul(1_000))
    }

    /// `n` units of 100 us, the unit of inhibit times (1015h, 1800h..:3).
    #[must_use]
    pub const fn from_inhibit(n: u16) -> Duration {
        Duration(n as u64 * 100)
    }

    /// Whether the span is 0: a timer that is switched off.
    #[must_use]
    pub const fn is_zero(self) -> bool {
        self.0 == 0
    }
}

/// Microseconds since start-up. 64 bits do not overflow in the life of a machine. A sum beyond the range is
/// [`NEVER`](Instant::NEVER).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant(pub u64);

impl Instant {
    /// Later than any other instant: no deadline.
    pub const NEVER: Instant = Instant(u64::MAX);

    /// The end of a span that begins at a known instant, such as the present: never near the end of the range. The range
    /// check of `+` costs more code than the sum.
    #[inline]
    pub(crate) const fn plus(self, span: Duration) -> Instant {
        Instant(self.0 + span.0)
    }

    /// The next due instant of a timer with a period in milliseconds, 0 for none. It is one period after this due
    /// instant, so that delays do not add up; after a long gap, or for a timer that starts, one period from now.
    #[inline(never)]
    pub(crate) fn following(self, period: u16, now: Instant) -> Instant {
        if period == 0 {
            return Instant::NEVER;
        }
        let period = Duration::from_millis(period.into());
        let last = if self == Instant::NEVER { now } else { self };
        let next = last.plus(period);
        if next > now { next } else { now.plus(period) }
    }
}

impl Add<Duration> for Instant {
    type Output = Instant;
    fn add(self, span: Duration) -> Instant {
        Instant(self.0.saturating_add(span.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_after_never_is_never() {
        assert_eq!(Instant::NEVER + Duration::from_millis(1), Instant::NEVER);
        assert_eq!(Instant(u64::MAX - 1) + Duration(5), Instant::NEVER);
    }
}
