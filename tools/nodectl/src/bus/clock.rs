//! The clock of real buses, and time stamps in text.

use std::sync::LazyLock;
use std::time;

use canopen::Instant;

/// One start for all buses, so that a deadline stays valid when a lost bus is opened again.
static START: LazyLock<time::Instant> = LazyLock::new(time::Instant::now);

/// Microseconds since the first use of the clock.
pub(crate) fn now() -> Instant {
    Instant(u64::try_from(START.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// The time that is left until an instant; 0 when the instant has passed.
pub(crate) fn left(until: Instant) -> time::Duration {
    time::Duration::from_micros(until.0.saturating_sub(now().0))
}

/// The instant of a time stamp of candump or socketcand.
pub(crate) fn parse(text: &str) -> Option<Instant> {
    wire::stamp::parse(text).map(Instant)
}
