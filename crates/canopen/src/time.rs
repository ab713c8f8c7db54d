//! Time in microseconds. The caller passes the time to every call; this crate reads no clock.

use core::cmp::Ordering;
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
}

/// Microseconds since start-up. 64 bits do not overflow in the life of a machine: a device works until 71 minutes before
/// their end, in 584,000 years. A sum beyond the range is [`NEVER`](Instant::NEVER).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant(pub u64);

impl Instant {
    /// Later than any other instant: no deadline.
    pub const NEVER: Instant = Instant(u64::MAX);
}

impl Add<Duration> for Instant {
    type Output = Instant;
    fn add(self, span: Duration) -> Instant {
        Instant(self.0.saturating_add(span.0))
    }
}

/// A time span inside a device, in microseconds: at most 71 minutes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span(pub(crate) u32);

impl Span {
    /// `n` milliseconds.
    pub(crate) const fn from_millis(n: u16) -> Span {
        Span(n as u32 * 1000)
    }

    /// `n` units of 100 us, the unit of inhibit times (1015h, 1800h..:3).
    pub(crate) const fn from_inhibit(n: u16) -> Span {
        Span(n as u32 * 100)
    }
}

/// A point of time inside a device: microseconds since the epoch of its [`Clock`].
///
/// The services of a device reach at most 71 minutes into the future and [`Clock::PAST`] into the past, so 32 bits are
/// enough for them. They take half the code and half the memory of 64 bits.
///
/// The number counts down to 0 for [`NEVER`](Tick::NEVER): most timers of a new device do not run, and zeros take the
/// least code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick(u32);

impl PartialOrd for Tick {
    fn partial_cmp(&self, other: &Tick) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Tick {
    fn cmp(&self, other: &Tick) -> Ordering {
        other.0.cmp(&self.0)
    }
}

impl Tick {
    /// Later than any other tick: no deadline.
    pub(crate) const NEVER: Tick = Tick(0);

    /// Earlier than any other tick: due at once.
    pub(crate) const PAST: Tick = Tick(u32::MAX);

    /// The tick after this time since the epoch.
    pub(crate) const fn since_epoch(microseconds: u32) -> Tick {
        Tick(!microseconds)
    }

    /// The time since an earlier tick in microseconds; 0 for a later one.
    pub(crate) const fn since(self, earlier: Tick) -> u32 {
        earlier.0.saturating_sub(self.0)
    }

    /// The end of a span that begins now or in the past.
    #[inline]
    pub(crate) const fn plus(self, span: Span) -> Tick {
        Tick(self.0 - span.0)
    }

    /// The end of a span of any length. The end is at most 71 minutes after the present.
    pub(crate) fn plus_long(self, microseconds: u32) -> Tick {
        Tick(self.0.saturating_sub(microseconds).max(1))
    }

    /// The next due tick of a timer with a period in milliseconds, 0 for none. It is one period after this due tick, so
    /// that delays do not add up; after a long gap, or for a timer that starts, one period from now.
    #[inline(never)]
    pub(crate) fn following(self, period: u16, now: Tick) -> Tick {
        if period == 0 {
            return Tick::NEVER;
        }
        let period = Span::from_millis(period);
        let last = if self == Tick::NEVER { now } else { self };
        let next = last.plus(period);
        if next > now { next } else { now.plus(period) }
    }

    /// The epoch has moved by a span. A tick before the new epoch becomes the epoch: it is long past.
    #[inline(never)]
    pub(crate) fn shift(&mut self, by: Span) {
        if *self != Tick::NEVER {
            self.0 = self.0.saturating_add(by.0);
        }
    }
}

/// Converts between the time of the caller and the ticks of a device.
#[derive(Debug)]
pub(crate) struct Clock {
    epoch: u64,
}

impl Clock {
    /// How far back the services look: inhibit times reach 6.6 s, and all others less.
    const PAST: u32 = 1 << 23;
    /// The epoch moves when the present is this far behind it.
    const LATEST: u32 = 1 << 25;

    pub(crate) const fn new() -> Clock {
        Clock { epoch: 0 }
    }

    /// The tick of the present, if the epoch needs not move for it.
    #[inline]
    pub(crate) fn tick(&self, now: Instant) -> Option<Tick> {
        let since = now.0.wrapping_sub(self.epoch);
        u32::try_from(since).ok().filter(|since| *since < Clock::LATEST).map(Tick::since_epoch)
    }

    /// Moves the epoch towards the present. Returns the tick of the present, and the span by which all ticks of the
    /// device shift.
    ///
    /// An instant before the epoch is that of a caller whose time went back: the epoch stays.
    pub(crate) fn follow(&mut self, now: Instant) -> (Tick, Span) {
        let Some(by) = now.0.saturating_sub(Clock::PAST.into()).checked_sub(self.epoch) else {
            return (Tick::PAST, Span(0));
        };
        self.epoch += by;
        (Tick::since_epoch(Clock::PAST), Span(u32::try_from(by).unwrap_or(u32::MAX)))
    }

    /// The instant of a tick.
    #[inline]
    pub(crate) fn instant(&self, tick: Tick) -> Instant {
        if tick == Tick::NEVER { Instant::NEVER } else { Instant(self.epoch.wrapping_add((!tick.0).into())) }
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

    #[test]
    fn a_timer_that_is_a_whole_period_late_is_due_a_period_from_now() {
        let (due, now) = (Tick::since_epoch(1000), Tick::since_epoch(101_000));
        assert!(due.following(100, now) == now.plus(Span::from_millis(100)));
        assert!(due.following(101, now) == Tick::since_epoch(102_000));
    }

    #[test]
    fn a_tick_keeps_its_instant_when_the_epoch_moves() {
        let mut clock = Clock::new();
        let mut due = clock.tick(Instant(20_000_000)).unwrap().plus(Span::from_millis(u16::MAX));
        assert_eq!(clock.tick(Instant(1 << 25)), None);
        let (now, by) = clock.follow(Instant(1 << 25));
        due.shift(by);
        assert_eq!(clock.instant(now), Instant(1 << 25));
        assert_eq!(clock.instant(due), Instant(85_535_000));
        assert_eq!(clock.tick(Instant(1 << 25)), Some(now));
    }

    #[test]
    fn a_missing_deadline_stays_missing_and_a_past_deadline_stays_past() {
        let mut clock = Clock::new();
        let (now, by) = clock.follow(Instant(u64::MAX / 2));
        let (mut never, mut past) = (Tick::NEVER, Tick::since_epoch(5));
        never.shift(by);
        past.shift(by);
        assert_eq!((never, clock.instant(never)), (Tick::NEVER, Instant::NEVER));
        assert!(past < now && clock.instant(past) < Instant(u64::MAX / 2));
    }
}
