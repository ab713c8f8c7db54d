//! Checks of the heartbeat producer.

use super::super::prelude::*;
use crate::Logged;

const PREOP: u8 = State::PreOperational.code();
const OP: u8 = State::Operational.code();
const STOPPED: u8 = State::Stopped.code();

pub(super) const CHECKS: &[Check] = &[
    Check::new("ERR-01", "1017h takes 0", "CiA 301, 7.5.2.20", takes_zero),
    Check::new("ERR-02", "1017h = 100: ten heartbeats in a second", "CiA 301, 7.2.8.3.2.2", ten),
    Check::new("ERR-03", "1017h = 0 silences the heartbeat", "CiA 301, 7.5.2.20", silent),
    Check::new("ERR-04", "A heartbeat in Pre-operational says 7Fh", "CiA 301, 7.2.8.3.2.2", says::<PREOP>),
    Check::new("ERR-05", "A heartbeat in Operational says 05h", "CiA 301, 7.2.8.3.2.2", says::<OP>),
    Check::new("ERR-06", "A heartbeat in Stopped says 04h", "CiA 301, 7.2.8.3.2.2", says::<STOPPED>),
    Check::new("ERR-07", "A heartbeat has one byte", "CiA 301, 7.2.8.3.2.2", one_byte),
    Check::new("ERR-08", "The period of a heartbeat is within 10 %", "CiA 301, 7.2.8.3.2.2", even)
        .recommended(),
    Check::new("ERR-09", "A new heartbeat time holds at once", "CiA 301, 7.5.2.20", at_once),
    Check::new(
        "ERR-10",
        "The heartbeat goes on through a change of state",
        "CiA 301, 7.2.8.3.2.2",
        through_changes,
    ),
    Check::new("ERR-11", "The device has heartbeat or guarding", "CiA 301, 7.2.8.2.2", has_either),
];

fn takes_zero(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1017, 0)?;
    s.set(0x1017, 0, 0)?;
    s.holds(0x1017, 0, 0)
}

/// The heartbeats within a time.
fn beats(s: &mut Subject<'_>, ms: u64) -> Outcome<Vec<Logged>> {
    let (mark, id) = (s.mark(), s.error_control());
    s.pass(ms)?;
    Ok(s.heard(mark, id))
}

fn ten(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.beat(100)?;
    let count = beats(s, 1000)?.len();
    ensure((9..=11).contains(&count), "9 to 11 heartbeats in 1 s", format!("{count}"))
}

fn silent(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.beat(100)?;
    s.beat(0)?;
    let count = beats(s, 500)?.len();
    ensure(count == 0, "no heartbeat", format!("{count} in 500 ms"))
}

fn says<const STATE: u8>(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    let state = [State::PreOperational, State::Operational, State::Stopped]
        .into_iter()
        .find(|state| state.code() == STATE);
    let state = state.unwrap_or(State::PreOperational);
    s.enter(state)?;
    s.tells(state)
}

fn one_byte(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    s.told_state()?;
    let beats = beats(s, 2000)?;
    let wrong = beats.iter().find(|heard| heard.frame.len() != 1 || heard.frame.data()[0] & 0x80 != 0);
    ensure(!beats.is_empty(), "heartbeats", "none in 2 s")?;
    ensure(
        wrong.is_none(),
        "one byte whose bit 7 is 0",
        format!("{:02X?}", wrong.map(|heard| heard.frame.data())),
    )
}

fn even(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.beat(100)?;
    let beats = beats(s, 2000)?;
    let gaps: Vec<u64> = beats.windows(2).map(|pair| pair[1].at.0.saturating_sub(pair[0].at.0)).collect();
    // The first gap may still have the former period.
    let worst = gaps.iter().skip(1).max_by_key(|gap| gap.abs_diff(100_000)).copied();
    let worst = worst.ok_or_else(|| fail("heartbeats each 100 ms", format!("{} in 2 s", beats.len())))?;
    ensure(worst.abs_diff(100_000) <= 10_000, "90 ms to 110 ms between heartbeats", format!("{worst} us"))
}

fn at_once(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.beat(60_000)?;
    s.beat(100)?;
    let count = beats(s, 500)?.len();
    ensure(count >= 3, "a heartbeat each 100 ms from the write on", format!("{count} in 500 ms"))
}

fn through_changes(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.beat(100)?;
    let (mark, id) = (s.mark(), s.error_control());
    for state in [State::Operational, State::Stopped, State::PreOperational, State::Operational] {
        s.enter(state)?;
        s.pass(230)?;
    }
    let count = s.heard(mark, id).len();
    ensure(
        (8..=16).contains(&count),
        "9 to 11 heartbeats in 1 s, and at most one more with each change",
        format!("{count}"),
    )
}

fn has_either(s: &mut Subject<'_>) -> Outcome {
    let (heartbeat, guarding) = (s.try_read(0x1017, 0)?.is_ok(), s.try_read(0x100C, 0)?.is_ok());
    ensure(heartbeat || guarding, "1017h or 100Ch", "neither")
}
