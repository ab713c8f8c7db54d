//! Checks with many frames in a row.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("ROB-40", "500 SYNC in a row do no harm", "CiA 301, 7.2.5", syncs),
    Check::new("ROB-41", "500 NMT commands for others do no harm", "CiA 301, 7.2.8.2.1", commands),
    Check::new("ROB-42", "SDO requests in a row: the last is answered", "CiA 301, 7.2.4", requests),
    Check::new("ROB-43", "The heartbeat goes on through a flood", "CiA 301, 7.2.8.3.2.2", heartbeat),
    Check::new("ROB-44", "100 uploads in a row are all answered", "CiA 301, 7.2.4", uploads),
    Check::new(
        "ROB-45",
        "50 changes between Pre-operational and Operational are all obeyed",
        "CiA 301, 7.3.2.1",
        changes,
    ),
    Check::new("ROB-46", "Foreign PDOs in a row do no harm", "CiA 301, 7.3.5", pdos),
];

fn syncs(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.enter(State::Operational)?;
    for _ in 0..500 {
        s.send(0x080, &[])?;
    }
    s.pass(500)?;
    s.serves("500 SYNC")
}

fn commands(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    let other = u8::try_from(s.id() % 127 + 1).unwrap_or(1);
    for number in 0..500_u16 {
        s.send(0x000, &[if number % 2 == 0 { 1 } else { 2 }, other])?;
    }
    s.pass(200)?;
    s.tells(State::PreOperational)
}

fn requests(s: &mut Subject<'_>) -> Outcome {
    let id = 0x600 + s.id();
    for _ in 0..50 {
        s.send(id, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
    }
    s.pass(200)?;
    s.serves("50 requests in a row")
}

fn heartbeat(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.need_writable(0x1017, 0)?;
    s.beat(100)?;
    let (mark, id) = (s.mark(), s.error_control());
    for _ in 0..20 {
        for _ in 0..50 {
            s.send(0x080, &[])?;
        }
        s.pass(50)?;
    }
    s.pass(200)?;
    let count = s.heard(mark, id).len();
    ensure(count >= 10, "at least ten heartbeats in more than 1.2 s", format!("{count}"))
}

fn uploads(s: &mut Subject<'_>) -> Outcome {
    let first = s.read(0x1000, 0)?;
    for number in 1..=100 {
        let again = s.read(0x1000, 0)?;
        ensure(
            again == first,
            format!("{first:02X?} each time"),
            format!("{again:02X?} at upload {number}"),
        )?;
    }
    Ok(())
}

fn changes(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1017, 0)?;
    for _ in 0..50 {
        s.command(Command::Start)?;
        s.command(Command::EnterPreOperational)?;
    }
    s.pass(50)?;
    s.beat(50)?;
    s.tells(State::PreOperational)
}

fn pdos(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    s.enter(State::Operational)?;
    let other = s.id() % 127 + 1;
    for number in 0..500_u16 {
        s.send(0x180 + other + 0x80 * (number % 4 * 2), &[0x55; 8])?;
    }
    s.pass(100)?;
    s.tells(State::Operational)?;
    s.serves("foreign PDOs in a row")
}
