//! The time of buses that are real, and time stamps in text.

use std::sync::LazyLock;
use std::time;

use canopen::Instant;

/// The start is one for all, so that a deadline outlives the bus that is lost and opened again.
static START: LazyLock<time::Instant> = LazyLock::new(time::Instant::now);

/// Microseconds since the first use of the clock.
pub(crate) fn now() -> Instant {
    Instant(u64::try_from(START.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// What is left until an instant; nothing when it has passed.
pub(crate) fn left(until: Instant) -> time::Duration {
    time::Duration::from_micros(until.0.saturating_sub(now().0))
}

/// The instant of a time stamp of candump or socketcand.
pub(crate) fn parse(text: &str) -> Option<Instant> {
    wire::stamp::parse(text).map(Instant)
}
