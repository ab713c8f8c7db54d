//! Checks that no PDO is sent in Stopped and in Pre-operational (CiA 301, table 38).

use super::super::prelude::*;

const STOPPED: bool = true;
const PREOP: bool = false;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "PDO-40",
        "Stopped: a remote frame for a TPDO is not answered",
        "CiA 301, table 38",
        remote::<STOPPED>,
    ),
    Check::new("PDO-41", "Stopped: event-driven TPDO silent", "CiA 301, table 38", silent::<STOPPED, 255, 0>),
    Check::new("PDO-42", "Stopped: event timer TPDO silent", "CiA 301, table 38", silent::<STOPPED, 254, 50>),
    Check::new("PDO-43", "Stopped: cyclic TPDO silent", "CiA 301, table 38", silent::<STOPPED, 1, 0>),
    Check::new("PDO-44", "Stopped: acyclic TPDO silent", "CiA 301, table 38", silent::<STOPPED, 0, 0>),
    Check::new(
        "PDO-45",
        "Stopped: TPDO with a SYNC start value silent",
        "CiA 301, table 38",
        start_value::<STOPPED>,
    ),
    Check::new(
        "PDO-46",
        "Pre-operational: a remote frame for a TPDO is not answered",
        "CiA 301, table 38",
        remote::<PREOP>,
    ),
    Check::new(
        "PDO-47",
        "Pre-operational: event-driven TPDO silent",
        "CiA 301, table 38",
        silent::<PREOP, 255, 0>,
    ),
    Check::new(
        "PDO-48",
        "Pre-operational: event timer TPDO silent",
        "CiA 301, table 38",
        silent::<PREOP, 254, 50>,
    ),
    Check::new("PDO-49", "Pre-operational: cyclic TPDO silent", "CiA 301, table 38", silent::<PREOP, 1, 0>),
    Check::new("PDO-50", "Pre-operational: acyclic TPDO silent", "CiA 301, table 38", silent::<PREOP, 0, 0>),
    Check::new(
        "PDO-51",
        "Pre-operational: TPDO with a SYNC start value silent",
        "CiA 301, table 38",
        start_value::<PREOP>,
    ),
];

fn state(is_stopped: bool) -> State {
    if is_stopped { State::Stopped } else { State::PreOperational }
}

/// Configures a TPDO, brings the device through Operational into a state, and counts the frames of the TPDO there.
fn listen(
    s: &mut Subject<'_>,
    pdo: super::super::subject::Pdo,
    is_stopped: bool,
    causes: impl Fn(&mut Subject<'_>) -> Outcome,
) -> Outcome {
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    s.pass(50)?;
    s.enter(state(is_stopped))?;
    let mark = s.mark();
    for _ in 0..5 {
        causes(s)?;
        s.pass(50)?;
    }
    let count = s.heard(mark, pdo.id()).len();
    ensure(count == 0, "no frame", format!("{count}"))
}

fn remote<const IS_STOPPED: bool>(s: &mut Subject<'_>) -> Outcome {
    let mut pdo = s.tpdo(254, 0)?;
    pdo.cob_id &= !0x4000_0000;
    if s.try_write(pdo.index, 1, &pdo.cob_id.to_le_bytes())?.is_err() {
        return Err(skip("the device has no remote frames, as CiA recommends (bit 30 of the COB-ID)"));
    }
    listen(s, pdo, IS_STOPPED, |s| s.remote(pdo.id(), 8))
}

fn silent<const IS_STOPPED: bool, const TYPE: u32, const TIMER: u32>(s: &mut Subject<'_>) -> Outcome {
    if TYPE <= 240 {
        s.need_solitude()?;
    }
    let pdo = s.tpdo(TYPE, TIMER)?;
    listen(s, pdo, IS_STOPPED, |s| if TYPE <= 240 { s.sync() } else { Ok(()) })
}

fn start_value<const IS_STOPPED: bool>(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(1, 0)?;
    s.need(pdo.index, 6)?;
    s.unlock_counter()?;
    s.set_if_supported(0x1019, 0, 10)?;
    s.set_if_supported(pdo.index, 6, 2)?;
    listen(s, pdo, IS_STOPPED, |s| {
        for counter in 1..=10 {
            s.send(0x080, &[counter])?;
        }
        Ok(())
    })
}
