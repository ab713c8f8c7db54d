//! Checks of the NMT states and of the services in each.

use super::super::prelude::*;

const PREOP: u8 = State::PreOperational.code();
const OP: u8 = State::Operational.code();
const STOPPED: u8 = State::Stopped.code();

pub(super) const CHECKS: &[Check] = &[
    Check::new("NMT-20", "Start from Pre-operational", "CiA 301, 7.3.2.1", change::<PREOP, OP>),
    Check::new("NMT-21", "Start from Stopped", "CiA 301, 7.3.2.1", change::<STOPPED, OP>),
    Check::new("NMT-22", "Stop from Pre-operational", "CiA 301, 7.3.2.1", change::<PREOP, STOPPED>),
    Check::new("NMT-23", "Stop from Operational", "CiA 301, 7.3.2.1", change::<OP, STOPPED>),
    Check::new("NMT-24", "Enter Pre-operational from Operational", "CiA 301, 7.3.2.1", change::<OP, PREOP>),
    Check::new("NMT-25", "Enter Pre-operational from Stopped", "CiA 301, 7.3.2.1", change::<STOPPED, PREOP>),
    Check::new("NMT-26", "SDO is served in Pre-operational", "CiA 301, table 38", served::<PREOP, true>),
    Check::new("NMT-27", "SDO is served in Operational", "CiA 301, table 38", served::<OP, true>),
    Check::new("NMT-28", "SDO is not served in Stopped", "CiA 301, table 38", served::<STOPPED, false>),
    Check::new("NMT-29", "A command for the present state changes nothing", "CiA 301, 7.3.2.1", same_state),
    Check::new("NMT-30", "A TPDO is sent in Operational", "CiA 301, table 38", sends_tpdo),
];

fn state(code: u8) -> State {
    match code {
        OP => State::Operational,
        STOPPED => State::Stopped,
        _ => State::PreOperational,
    }
}

fn change<const FROM: u8, const TO: u8>(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    s.enter(state(FROM))?;
    s.tells(state(FROM))?;
    s.enter(state(TO))?;
    s.tells(state(TO))
}

fn served<const STATE: u8, const IS_SERVED: bool>(s: &mut Subject<'_>) -> Outcome {
    s.enter(state(STATE))?;
    let is_served = s.is_served()?;
    let words = |served: bool| if served { "an answer" } else { "no answer" };
    ensure(is_served == IS_SERVED, words(IS_SERVED), words(is_served))
}

fn same_state(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    for state in [State::PreOperational, State::Operational, State::Stopped] {
        s.enter(state)?;
        let (mark, id) = (s.mark(), s.error_control());
        s.enter(state)?;
        s.tells(state)?;
        let boot_ups = s.heard(mark, id).iter().filter(|heard| heard.frame.data() == [0]).count();
        ensure(boot_ups == 0, "no boot-up message", "one")?;
    }
    Ok(())
}

fn sends_tpdo(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(254, 100)?;
    let count = s.count(pdo, State::Operational, 1000)?;
    ensure(count > 0, "a TPDO each 100 ms", "none in 1 s")
}
