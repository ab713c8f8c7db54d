//! Checks with frames for other nodes, and of the CAN-IDs that the device uses.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("ROB-01", "An SDO request for another node is not answered", "CiA 301, 7.3.5", foreign_sdo),
    Check::new("ROB-02", "Only CAN-IDs of the device's own are sent", "CiA 301, 7.3.5", own_ids),
    Check::new(
        "ROB-03",
        "An SDO response of another node disturbs no transfer",
        "CiA 301, 7.2.4",
        foreign_response,
    ),
    Check::new("ROB-04", "Heartbeats and EMCY of others change nothing", "CiA 301, 7.3.5", foreign_messages),
    Check::new("ROB-05", "TIME changes nothing else", "CiA 301, 7.2.6", time),
    Check::new("ROB-06", "LSS requests for others change nothing", "CiA 305, 3.7", foreign_lss),
];

fn foreign_sdo(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let (mark, own) = (s.mark(), s.id());
    for node in (1..=127).filter(|node| *node != own) {
        s.send(0x600 + node, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
    }
    s.pass(300)?;
    let answers = s.since(mark).filter(|logged| matches!(logged.frame.id(), 0x581..=0x5FF)).count();
    ensure(answers == 0, "no answer", format!("{answers}"))
}

/// Demands that the device sends only on CAN-IDs of the pre-defined connection set and of its COB-ID entries.
fn own_ids(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let own = s.id();
    let mut allowed = vec![0x80, 0x80 + own, 0x580 + own, 0x700 + own, 0x7E4];
    for index in s.pdos(TPDO)? {
        allowed.push(u16::try_from(s.number(index, 1)? & 0x7FF).unwrap_or(0));
    }
    for index in [0x1005, 0x1012, 0x1014] {
        if let Some(value) = s.optional(index, 0)? {
            allowed.push(u16::try_from(value & 0x7FF).unwrap_or(0));
        }
    }
    let mark = s.mark();
    s.enter(State::Operational)?;
    s.pass(2000)?;
    let strange: Vec<u16> =
        s.since(mark).map(|logged| logged.frame.id()).filter(|id| !allowed.contains(id)).collect();
    ensure(strange.is_empty(), "only own CAN-IDs", format!("{strange:03X?}"))
}

fn foreign_response(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let other = s.id() % 127 + 1;
    let before = s.read(0x1018, 1)?;
    s.send(0x580 + other, &[0x80, 0x18, 0x10, 1, 0, 0, 2, 6])?;
    let after = s.read(0x1018, 1)?;
    ensure(before == after, format!("{before:02X?}"), format!("{after:02X?}"))
}

fn foreign_messages(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    let (mark, own) = (s.mark(), s.id());
    for node in (1..=127).filter(|node| *node != own) {
        s.send(0x700 + node, &[0x7F])?;
        s.send(0x080 + node, &[0x00, 0x10, 1, 0, 0, 0, 0, 0])?;
    }
    s.tells(State::PreOperational)?;
    let told = s.heard(mark, 0x80 + own).len();
    ensure(told == 0, "no EMCY", format!("{told}"))
}

fn time(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    for len in [6, 0, 8] {
        s.send(0x100, &[0xFF; 8][..len])?;
    }
    s.tells(State::PreOperational)?;
    s.serves("TIME")
}

fn foreign_lss(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let mark = s.mark();
    for request in [[0x40, 1, 2, 3, 4, 0, 0, 0], [0x46, 1, 2, 3, 4, 0, 0, 0], [0x11, 9, 0, 0, 0, 0, 0, 0]] {
        s.send(0x7E5, &request)?;
    }
    s.pass(200)?;
    let answers = s.heard(mark, 0x7E4).len();
    ensure(answers == 0, "no answer", format!("{answers}"))?;
    s.serves("LSS requests for others")
}
