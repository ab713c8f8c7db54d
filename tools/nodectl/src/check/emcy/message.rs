//! Checks of the EMCY messages.

use super::super::prelude::*;
use super::provoke::{LIFE, codes, heartbeat_is_back, lose_heartbeat, messages, unused_node_id, watch};

pub(super) const CHECKS: &[Check] = &[
    Check::new("EMC-20", "An error sends an EMCY with its code", "CiA 301, table 26", code),
    Check::new("EMC-21", "An error sends one EMCY", "CiA 301, 7.2.7.1", once),
    Check::new("EMC-22", "An EMCY has eight bytes", "CiA 301, 7.2.7.3", eight_bytes),
    Check::new(
        "EMC-23",
        "An EMCY carries the error register, and 1001h agrees",
        "CiA 301, 7.2.7.3",
        register,
    ),
    Check::new("EMC-24", "The end of the error is told by EMCY 0000h", "CiA 301, 7.2.7.1", reset),
    Check::new("EMC-25", "1001h is as before when the error is gone", "CiA 301, 7.5.2.2", register_back),
    Check::new("EMC-26", "No EMCY in Stopped", "CiA 301, table 38", stopped),
    Check::new("EMC-27", "The inhibit time of 1015h is kept", "CiA 301, 7.5.2.18", inhibited),
    Check::new("EMC-28", "A restart without an error sends no EMCY", "CiA 301, 7.2.7.1", boot).resets(),
];

fn code(s: &mut Subject<'_>) -> Outcome {
    let node = unused_node_id(s);
    let mark = lose_heartbeat(s, node)?;
    let codes = codes(s, mark);
    ensure(codes.contains(&LIFE), "EMCY 8130h", format!("{codes:04X?}"))
}

fn once(s: &mut Subject<'_>) -> Outcome {
    let node = unused_node_id(s);
    let mark = lose_heartbeat(s, node)?;
    s.pass(500)?;
    let count = codes(s, mark).iter().filter(|code| **code == LIFE).count();
    ensure(count == 1, "one EMCY 8130h", format!("{count}"))
}

fn eight_bytes(s: &mut Subject<'_>) -> Outcome {
    let node = unused_node_id(s);
    let mark = lose_heartbeat(s, node)?;
    let messages = messages(s, mark);
    ensure(!messages.is_empty(), "an EMCY", "none")?;
    let wrong = messages.iter().find(|heard| heard.frame.len() != 8);
    ensure(wrong.is_none(), "eight bytes", format!("{:02X?}", wrong.map(|heard| heard.frame.data())))
}

fn register(s: &mut Subject<'_>) -> Outcome {
    let node = unused_node_id(s);
    let mark = lose_heartbeat(s, node)?;
    let told = messages(s, mark).last().and_then(|heard| heard.frame.data().get(2).copied());
    let told = told.ok_or_else(|| fail("an EMCY with an error register", "none"))?;
    ensure(told & 1 != 0, "bit 0 in byte 2", format!("{told:02X}h"))?;
    s.holds(0x1001, 0, told.into())
}

fn reset(s: &mut Subject<'_>) -> Outcome {
    let before = s.number(0x1001, 0)?;
    if before != 0 {
        return Err(skip("the device has another error"));
    }
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    let mark = heartbeat_is_back(s, node)?;
    let codes = codes(s, mark);
    ensure(codes.contains(&0), "EMCY 0000h", format!("{codes:04X?}"))
}

fn register_back(s: &mut Subject<'_>) -> Outcome {
    let before = s.number(0x1001, 0)?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    heartbeat_is_back(s, node)?;
    s.holds(0x1001, 0, before)
}

fn stopped(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let node = unused_node_id(s);
    if s.try_read(0x1016, 1)?.is_err() {
        return Err(skip("no error can be caused from the bus: the device has no 1016h"));
    }
    s.plain_emcy()?;
    watch(s, node)?;
    s.send(0x700 + node, &[0x05])?;
    s.enter(State::Stopped)?;
    let mark = s.mark();
    s.pass(500)?;
    let count = messages(s, mark).len();
    ensure(count == 0, "no EMCY", format!("{count}"))
}

fn inhibited(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1015, 0)?;
    s.set(0x1015, 0, 10_000)?;
    let node = unused_node_id(s);
    let mark = lose_heartbeat(s, node)?;
    heartbeat_is_back(s, node)?;
    s.pass(1500)?;
    let messages = messages(s, mark);
    let gaps: Vec<u64> = messages.windows(2).map(|pair| pair[1].at.0.saturating_sub(pair[0].at.0)).collect();
    ensure(messages.len() > 1, "the error and its end", format!("{} messages", messages.len()))?;
    ensure(gaps.iter().all(|gap| *gap >= 990_000), "1 s between messages", format!("{gaps:?} us"))
}

fn boot(s: &mut Subject<'_>) -> Outcome {
    if s.number(0x1001, 0)? != 0 {
        return Err(skip("the device has an error"));
    }
    let mark = s.mark();
    s.reset(Command::ResetNode)?;
    s.pass(500)?;
    if s.number(0x1001, 0)? != 0 {
        return Err(skip("the device has an error after the restart"));
    }
    let codes: Vec<u16> = codes(s, mark).into_iter().filter(|code| *code != 0).collect();
    ensure(codes.is_empty(), "no EMCY", format!("{codes:04X?}"))
}
