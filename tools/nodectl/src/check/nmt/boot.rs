//! Checks of restart and boot-up message.

use super::super::prelude::*;
use crate::Logged;

/// The parameters of a check: the state before the restart, and the restart.
const NODE: bool = true;
const COMMUNICATION: bool = false;

const PREOP: u8 = State::PreOperational.code();
const OP: u8 = State::Operational.code();
const STOPPED: u8 = State::Stopped.code();

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "NMT-01",
        "Reset node: one boot-up message of one byte 0",
        "CiA 301, 7.2.8.3.3",
        one_boot_up::<NODE, PREOP>,
    )
    .resets(),
    Check::new(
        "NMT-02",
        "Reset communication: one boot-up message of one byte 0",
        "CiA 301, 7.2.8.3.3",
        one_boot_up::<COMMUNICATION, PREOP>,
    )
    .resets(),
    Check::new("NMT-03", "Reset node from Operational", "CiA 301, 7.3.2.1", one_boot_up::<NODE, OP>).resets(),
    Check::new("NMT-04", "Reset node from Stopped", "CiA 301, 7.3.2.1", one_boot_up::<NODE, STOPPED>)
        .resets(),
    Check::new(
        "NMT-05",
        "Reset communication from Operational",
        "CiA 301, 7.3.2.1",
        one_boot_up::<COMMUNICATION, OP>,
    )
    .resets(),
    Check::new(
        "NMT-06",
        "Reset communication from Stopped",
        "CiA 301, 7.3.2.1",
        one_boot_up::<COMMUNICATION, STOPPED>,
    )
    .resets(),
    Check::new(
        "NMT-07",
        "After reset node the device rests in Pre-operational",
        "CiA 301, 7.3.2.2.1",
        rests::<NODE>,
    )
    .resets(),
    Check::new(
        "NMT-08",
        "After reset communication the device rests in Pre-operational",
        "CiA 301, 7.3.2.2.1",
        rests::<COMMUNICATION>,
    )
    .resets(),
    Check::new(
        "NMT-09",
        "The boot-up message is the first frame after a restart",
        "CiA 301, 7.3.2.2.1",
        first_frame,
    )
    .resets(),
    Check::new(
        "NMT-10",
        "Reset communication brings back communication parameters",
        "CiA 301, 7.3.2.2.1",
        parameters_return,
    )
    .resets(),
    Check::new("NMT-11", "SDO is served after the boot-up message", "CiA 301, 7.3.2.2.1", serves_after_boot)
        .resets(),
    Check::new("NMT-12", "The device boots within 5 s", "CiA 301, 7.3.2", soon).resets().recommended(),
];

fn command(is_node: bool) -> Command {
    if is_node { Command::ResetNode } else { Command::ResetCommunication }
}

fn enter(s: &mut Subject<'_>, state: u8) -> Outcome {
    match state {
        OP => s.enter(State::Operational),
        STOPPED => s.enter(State::Stopped),
        _ => s.enter(State::PreOperational),
    }
}

/// The number of boot-up messages among error control frames. A device that initialises sends the state 0.
fn boot_ups(heard: &[Logged]) -> usize {
    heard.iter().filter(|heard| heard.frame.data().first() == Some(&0)).count()
}

fn one_boot_up<const IS_NODE: bool, const STATE: u8>(s: &mut Subject<'_>) -> Outcome {
    enter(s, STATE)?;
    let (mark, id) = (s.mark(), s.error_control());
    s.reset(command(IS_NODE))?;
    s.pass(500)?;
    let heard = s.heard(mark, id);
    let count = boot_ups(&heard);
    let is_one_byte = heard.iter().all(|heard| heard.frame.len() == 1);
    ensure(count == 1 && is_one_byte, "one boot-up message of one byte", format!("{count} boot-up messages"))
}

fn rests<const IS_NODE: bool>(s: &mut Subject<'_>) -> Outcome {
    s.need_no_self_start()?;
    s.enter(State::Operational)?;
    s.reset(command(IS_NODE))?;
    s.beat(50)?;
    s.tells(State::PreOperational)
}

fn first_frame(s: &mut Subject<'_>) -> Outcome {
    s.enter(State::Operational)?;
    s.pass(100)?;
    let (mark, id) = (s.mark(), s.error_control());
    s.reset(Command::ResetNode)?;
    let own = s.id();
    // Frames that were on their way when the command came do not count.
    let of_device =
        s.since(mark).skip_while(|logged| logged.frame.id() != id && logged.frame.id() & 0x7F != own);
    let first = of_device.map(|logged| logged.frame.id()).next();
    ensure(first == Some(id), format!("{id:03X}h first"), format!("{:03X}h", first.unwrap_or(0)))
}

fn parameters_return(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.reset(Command::ResetCommunication)?;
    let before = s.number(0x1017, 0)?;
    s.set(0x1017, 0, if before == 4321 { 1234 } else { 4321 })?;
    s.reset(Command::ResetCommunication)?;
    s.holds(0x1017, 0, before)
}

fn serves_after_boot(s: &mut Subject<'_>) -> Outcome {
    s.enter(State::Stopped)?;
    s.reset(Command::ResetNode)?;
    s.need_no_self_start()?;
    s.serves("the boot-up message")
}

fn soon(s: &mut Subject<'_>) -> Outcome {
    let (mark, id) = (s.mark(), s.error_control());
    s.command(Command::ResetNode)?;
    for _ in 0..50 {
        s.pass(100)?;
        if boot_ups(&s.heard(mark, id)) > 0 {
            return Ok(());
        }
    }
    Err(fail("a boot-up message within 5 s", "none"))
}
