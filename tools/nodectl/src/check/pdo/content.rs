//! Checks of the values in a PDO, compared with the values by SDO.

use eds::Entry;

use super::super::prelude::*;
use super::super::subject::{mapped, size};

pub(super) const CHECKS: &[Check] = &[
    Check::new("PDO-80", "A TPDO carries what SDO reads", "CiA 301, 7.5.2.38", transmit),
    Check::new("PDO-81", "What an RPDO brings is read by SDO", "CiA 301, 7.5.2.36", receive),
    Check::new("PDO-82", "Two objects stand in a TPDO in their order", "CiA 301, 7.5.2.38", order),
];

/// Maps objects whose values do not change by themselves, and receives the frame.
fn frame_of(s: &mut Subject<'_>, entries: &[Entry]) -> Outcome<Vec<u8>> {
    let mut pdo = s.tpdo(254, 50)?;
    s.empty(pdo)?;
    for (entry, sub) in entries.iter().zip(1..) {
        s.set(pdo.mapping(), sub, mapped(entry))?;
    }
    s.set(pdo.mapping(), 0, u32::try_from(entries.len()).unwrap_or(1))?;
    pdo.cob_id &= !OFF;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    let frame = s.next(mark, pdo.id(), 500)?.ok_or_else(|| fail("a TPDO", "none in 500 ms"))?;
    Ok(frame.frame.data().to_vec())
}

/// Up to `most` mappable objects that keep their value for a while.
fn steady(s: &mut Subject<'_>, most: usize) -> Outcome<Vec<Entry>> {
    let candidates = s.entries(|entry| {
        entry.is_tpdo_mappable() && entry.index >= 0x2000 && matches!(size(entry), Some(1..=4))
    })?;
    let mut steady: Vec<Entry> = Vec::new();
    for entry in candidates.into_iter().take(40) {
        let first = s.try_read(entry.index, entry.sub)?;
        s.pass(30)?;
        let again = s.try_read(entry.index, entry.sub)?;
        if first.is_ok() && first == again && steady.len() < most {
            steady.push(entry);
        }
    }
    Ok(steady)
}

fn transmit(s: &mut Subject<'_>) -> Outcome {
    let entries = steady(s, 1)?;
    let entry = entries.first().ok_or_else(|| skip("no mappable object is steady"))?;
    let frame = frame_of(s, &entries)?;
    let read = s.read(entry.index, entry.sub)?;
    ensure(
        frame == read,
        format!("{read:02X?}, as {:04X}h:{} reads", entry.index, entry.sub),
        format!("{frame:02X?}"),
    )
}

fn order(s: &mut Subject<'_>) -> Outcome {
    let entries = steady(s, 2)?;
    if entries.len() < 2 {
        return Err(skip("fewer than two mappable objects are steady"));
    }
    let frame = frame_of(s, &entries)?;
    let mut read = Vec::new();
    for entry in &entries {
        read.extend(s.read(entry.index, entry.sub)?);
    }
    ensure(frame == read, format!("{read:02X?}"), format!("{frame:02X?}"))
}

fn receive(s: &mut Subject<'_>) -> Outcome {
    let entry = super::rpdo::output(s)?;
    let pdo = super::rpdo::listening(s, &entry, 255)?;
    let value = super::rpdo::other_value(s, &entry)?;
    s.send(pdo.id(), &value)?;
    s.pass(50)?;
    let read = s.read(entry.index, entry.sub)?;
    ensure(
        read == value,
        format!("{value:02X?} in {:04X}h:{}", entry.index, entry.sub),
        format!("{read:02X?}"),
    )
}
