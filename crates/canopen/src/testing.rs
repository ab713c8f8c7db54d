//! For the tests of a product: the rule that every call of a device keeps.

use crate::{Instant, Next};

/// Number of polls at one instant after which a device must have nothing left to do.
const POLLS: usize = 16;

/// Polls a device until nothing is left to do at `now`, and returns the last result. `poll` makes one poll, carries out
/// or keeps the action, and returns the result.
///
/// A deadline in the past would make the caller poll without end, and starve everything with a lower priority. A device
/// therefore has no deadline at or before `now` after a few polls. Tests of a product should poll with this function.
///
/// # Panics
/// When a deadline still lies at or before `now`.
#[track_caller]
pub fn settle(now: Instant, mut poll: impl FnMut() -> Next) -> Next {
    let mut next = poll();
    for _ in 1..POLLS {
        if next.action.is_none() && next.due() > now {
            break;
        }
        next = poll();
    }
    assert!(next.action.is_none() && next.due() > now, "after a poll at {now:?}, {next:?} is due");
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(at: u64) -> Next {
        Next { action: None, process: Instant(at), services: Instant::NEVER, parameters: false }
    }

    #[test]
    fn work_may_take_a_few_polls() {
        let mut polls = 0;
        let next = settle(Instant(100), || {
            polls += 1;
            due(if polls < 3 { 100 } else { 101 })
        });
        assert_eq!((next.due(), polls), (Instant(101), 3));
        let next = settle(Instant(100), || due(200));
        assert_eq!(next.due(), Instant(200));
    }

    #[test]
    #[should_panic(expected = "is due")]
    fn a_deadline_in_the_past_is_an_error() {
        let _ = settle(Instant(100), || due(100));
    }
}
