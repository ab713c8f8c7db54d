//! Checks of node guarding, which is optional.

use super::super::prelude::*;

const PREOP: u8 = State::PreOperational.code();
const OP: u8 = State::Operational.code();
const STOPPED: u8 = State::Stopped.code();

pub(super) const CHECKS: &[Check] = &[
    Check::new("ERR-40", "100Ch and 100Dh exist together", "CiA 301, 7.5.2.11", together),
    Check::new(
        "ERR-41",
        "A guarding answer in Pre-operational says 7Fh and toggles",
        "CiA 301, 7.2.8.3.2.1",
        answers::<PREOP>,
    ),
    Check::new(
        "ERR-42",
        "A guarding answer in Operational says 05h and toggles",
        "CiA 301, 7.2.8.3.2.1",
        answers::<OP>,
    ),
    Check::new(
        "ERR-43",
        "A guarding answer in Stopped says 04h and toggles",
        "CiA 301, 7.2.8.3.2.1",
        answers::<STOPPED>,
    ),
    Check::new(
        "ERR-44",
        "The toggle bit begins with 0 after reset communication",
        "CiA 301, 7.2.8.3.2.1",
        first_toggle,
    )
    .resets(),
    Check::new("ERR-45", "A remote frame for another node stays unanswered", "CiA 301, 7.2.8.3.2.1", foreign),
    Check::new("ERR-46", "100Ch and 100Dh take new values", "CiA 301, 7.5.2.11", take_values),
    Check::new(
        "ERR-47",
        "Life guarding tells a lost master by EMCY 8130h",
        "CiA 301, 7.2.8.3.2.1",
        life_guarding,
    ),
    Check::new(
        "ERR-48",
        "Heartbeat has priority over guarding: Pre-operational",
        "CiA 301, 7.2.8.2.2",
        priority::<PREOP>,
    ),
    Check::new(
        "ERR-49",
        "Heartbeat has priority over guarding: Operational",
        "CiA 301, 7.2.8.2.2",
        priority::<OP>,
    ),
    Check::new(
        "ERR-50",
        "Heartbeat has priority over guarding: Stopped",
        "CiA 301, 7.2.8.2.2",
        priority::<STOPPED>,
    ),
    Check::new("ERR-51", "Guarding is back when the heartbeat is off again", "CiA 301, 7.2.8.2.2", back),
];

fn together(s: &mut Subject<'_>) -> Outcome {
    let (time, factor) = (s.try_read(0x100C, 0)?.is_ok(), s.try_read(0x100D, 0)?.is_ok());
    ensure(time == factor, "both, or neither", if time { "only 100Ch" } else { "only 100Dh" })
}

/// Switches the heartbeat off, if the device has one. Skipped where the device has no node guarding.
fn need_guarding(s: &mut Subject<'_>) -> Outcome {
    s.need(0x100C, 0)?;
    if s.try_read(0x1017, 0)?.is_ok() {
        s.beat(0)?;
    }
    Ok(())
}

fn enter(s: &mut Subject<'_>, state: u8) -> Outcome {
    match state {
        OP => s.enter(State::Operational),
        STOPPED => s.enter(State::Stopped),
        _ => s.enter(State::PreOperational),
    }
}

fn guard(s: &mut Subject<'_>) -> Outcome<u8> {
    let (mark, id) = (s.mark(), s.error_control());
    s.remote(id, 1)?;
    let answer = s.next(mark, id, 200)?.ok_or_else(|| fail("an answer to the remote frame", "none"))?;
    s.pass(20)?;
    answer.frame.data().first().copied().ok_or_else(|| fail("one byte", "none"))
}

fn answers<const STATE: u8>(s: &mut Subject<'_>) -> Outcome {
    need_guarding(s)?;
    enter(s, STATE)?;
    let first = guard(s)?;
    let second = guard(s)?;
    ensure(
        first & 0x7F == STATE && second & 0x7F == STATE,
        format!("the state {STATE:02X}h"),
        format!("{first:02X}h, {second:02X}h"),
    )?;
    ensure((first ^ second) & 0x80 != 0, "bit 7 that alternates", format!("{first:02X}h, {second:02X}h"))
}

fn first_toggle(s: &mut Subject<'_>) -> Outcome {
    need_guarding(s)?;
    guard(s)?;
    s.reset(Command::ResetCommunication)?;
    need_guarding(s)?;
    let first = guard(s)?;
    ensure(first & 0x80 == 0, "bit 7 of the first answer is 0", format!("{first:02X}h"))
}

fn foreign(s: &mut Subject<'_>) -> Outcome {
    let (mark, own) = (s.mark(), s.id());
    for node in [own % 127 + 1, (own + 60) % 127 + 1] {
        s.remote(0x700 + node, 1)?;
    }
    s.pass(200)?;
    let answers = s
        .since(mark)
        .filter(|logged| matches!(logged.frame.id(), 0x701..=0x77F) && logged.frame.id() != 0x700 + own);
    let count = answers.count();
    ensure(count == 0, "no answer for other nodes", format!("{count}"))
}

fn take_values(s: &mut Subject<'_>) -> Outcome {
    need_guarding(s)?;
    s.set(0x100C, 0, 500)?;
    s.set(0x100D, 0, 3)?;
    s.holds(0x100C, 0, 500)?;
    s.holds(0x100D, 0, 3)
}

fn life_guarding(s: &mut Subject<'_>) -> Outcome {
    need_guarding(s)?;
    s.need(0x1014, 0)?;
    s.plain_emcy()?;
    s.set(0x100C, 0, 100)?;
    s.set(0x100D, 0, 2)?;
    guard(s)?;
    guard(s)?;
    let (mark, id) = (s.mark(), 0x80 + s.id());
    let told = s.next(mark, id, 1000)?;
    let data = told.map(|told| told.frame.data().to_vec()).unwrap_or_default();
    ensure(data.starts_with(&[0x30, 0x81]), "EMCY 8130h", format!("{data:02X?}"))
}

fn priority<const STATE: u8>(s: &mut Subject<'_>) -> Outcome {
    s.need(0x100C, 0)?;
    s.beat(5000)?;
    enter(s, STATE)?;
    s.pass(50)?;
    let (mark, id) = (s.mark(), s.error_control());
    s.remote(id, 1)?;
    s.pass(200)?;
    let answers = s.heard(mark, id).len();
    ensure(answers == 0, "no answer to guarding while the heartbeat is on", format!("{answers}"))
}

fn back(s: &mut Subject<'_>) -> Outcome {
    s.need(0x100C, 0)?;
    s.need_writable(0x1017, 0)?;
    s.beat(5000)?;
    s.beat(0)?;
    guard(s).map(drop)
}
