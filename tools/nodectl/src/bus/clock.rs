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

/// `SECONDS.FRACTION`, as candump and socketcand write a time stamp; digits below a microsecond are cut off.
pub(crate) fn parse(text: &str) -> Option<Instant> {
    let (seconds, fraction) = text.split_once('.')?;
    let micros = format!("{fraction:0<6}").get(..6)?.parse::<u64>().ok()?;
    Some(Instant(seconds.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(micros)?))
}
