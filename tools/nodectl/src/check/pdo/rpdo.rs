//! Checks of the reception of RPDOs.

use eds::{Class, Entry};

use super::super::prelude::*;
use super::super::subject::{Pdo, mapped, size};
use crate::object::at;

pub(super) const CHECKS: &[Check] = &[
    Check::new("PDO-90", "Pre-operational: an RPDO is not taken", "CiA 301, table 38", not_taken::<false>),
    Check::new("PDO-91", "Stopped: an RPDO is not taken", "CiA 301, table 38", not_taken::<true>),
    Check::new("PDO-92", "An RPDO that is too short is not taken", "CiA 301, 7.2.2.5.1", short),
    Check::new("PDO-93", "An RPDO that is too short is told by EMCY 8210h", "CiA 301, 7.2.2.5.1", short_emcy)
        .recommended(),
    Check::new("PDO-94", "Of an RPDO that is too long the first bytes are taken", "CiA 301, 7.2.2.5.1", long),
    Check::new("PDO-95", "A synchronous RPDO is taken with the next SYNC", "CiA 301, table 68", synchronous),
    Check::new("PDO-96", "An RPDO that is off is not taken", "CiA 301, 7.5.2.35", off),
    Check::new(
        "PDO-97",
        "An RPDO is taken with the CAN-ID that it was given, and with no other",
        "CiA 301, 7.5.2.35",
        moved,
    ),
    Check::new(
        "PDO-98",
        "An RPDO whose event timer elapses is told by EMCY 8250h",
        "CiA 301, 7.5.2.35",
        deadline,
    )
    .recommended(),
];

/// An output that can be read back and may have any value.
pub(super) fn output(s: &mut Subject<'_>) -> Outcome<Entry> {
    let entries = s.entries(|entry| {
        let is_number = matches!(entry.data_type.class(), Class::Unsigned(8..=32) | Class::Signed(_));
        let is_free = entry.low.is_none() && entry.high.is_none() && entry.access.is_readable();
        entry.is_rpdo_mappable()
            && is_free
            && is_number
            && entry.index >= 0x2000
            && matches!(size(entry), Some(1..=4))
    })?;
    for entry in entries {
        // An object that changes by itself cannot hold a test value.
        let first = s.try_read(entry.index, entry.sub)?;
        s.pass(20)?;
        if first.is_ok() && first == s.try_read(entry.index, entry.sub)? {
            return Ok(entry);
        }
    }
    Err(skip("the data sheet has no output that can be read back"))
}

/// A value other than the value of the output: the lowest bit is different.
pub(super) fn other_value(s: &mut Subject<'_>, entry: &Entry) -> Outcome<Vec<u8>> {
    let mut value = s.read(entry.index, entry.sub)?;
    if let Some(byte) = value.first_mut() {
        *byte ^= 1;
    }
    Ok(value)
}

/// Switches an RPDO of this type with the output on, and the device to Operational. After the check the output gets its
/// value back.
pub(super) fn listening(s: &mut Subject<'_>, entry: &Entry, transmission: u32) -> Outcome<Pdo> {
    let before = s.read(entry.index, entry.sub)?;
    let pdo = s.pdo(RPDO)?;
    s.empty(pdo)?;
    s.set_if_supported(pdo.index, 2, transmission)?;
    s.set(pdo.mapping(), 1, mapped(entry))?;
    s.set(pdo.mapping(), 0, 1)?;
    s.switch_on(pdo)?;
    s.remember(at(entry.index, entry.sub), before);
    s.enter(State::Operational)?;
    Ok(pdo)
}

/// Sends an RPDO. Returns whether the object has the expected value then.
fn arrives(s: &mut Subject<'_>, entry: &Entry, id: u16, frame: &[u8], value: &[u8]) -> Outcome<bool> {
    s.send(id, frame)?;
    s.pass(50)?;
    Ok(s.read(entry.index, entry.sub)? == value)
}

fn not_taken<const IS_STOPPED: bool>(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    let value = other_value(s, &entry)?;
    s.enter(if IS_STOPPED { State::Stopped } else { State::PreOperational })?;
    s.send(pdo.id(), &value)?;
    s.pass(50)?;
    s.enter(State::PreOperational)?;
    let read = s.read(entry.index, entry.sub)?;
    ensure(read != value, "the value stays", format!("{read:02X?}"))
}

fn short(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    let value = other_value(s, &entry)?;
    let taken = arrives(s, &entry, pdo.id(), &value[..value.len() - 1], &value)?;
    ensure(!taken, "the value stays", "it was taken")?;
    s.serves("an RPDO that is too short")
}

fn short_emcy(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    s.plain_emcy()?;
    let (mark, id) = (s.mark(), 0x80 + s.id());
    s.send(pdo.id(), &[])?;
    let told = s.next(mark, id, 300)?.map(|told| told.frame.data().to_vec()).unwrap_or_default();
    ensure(told.starts_with(&[0x10, 0x82]), "EMCY 8210h", format!("{told:02X?}"))
}

fn long(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    let value = other_value(s, &entry)?;
    let mut frame = value.clone();
    frame.push(0xA5);
    let taken = arrives(s, &entry, pdo.id(), &frame, &value)?;
    ensure(taken, format!("{value:02X?} taken"), "the value stays")
}

fn synchronous(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let entry = output(s)?;
    s.plain_sync()?;
    let pdo = listening(s, &entry, 1)?;
    let value = other_value(s, &entry)?;
    let early = arrives(s, &entry, pdo.id(), &value, &value)?;
    ensure(!early, "the value stays until the SYNC", "it was taken at once")?;
    s.sync()?;
    let read = s.read(entry.index, entry.sub)?;
    ensure(read == value, format!("{value:02X?} after the SYNC"), format!("{read:02X?}"))
}

fn off(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    s.set(pdo.index, 1, pdo.cob_id | OFF)?;
    let value = other_value(s, &entry)?;
    let taken = arrives(s, &entry, pdo.id(), &value, &value)?;
    ensure(!taken, "the value stays", "it was taken")
}

fn moved(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    s.set(pdo.index, 1, pdo.cob_id | OFF)?;
    s.set_if_supported(pdo.index, 1, OFF | 0x6D5)?;
    s.set_if_supported(pdo.index, 1, 0x6D5)?;
    let value = other_value(s, &entry)?;
    let old = arrives(s, &entry, pdo.id(), &value, &value)?;
    ensure(!old, "nothing is taken with the former CAN-ID", "it was taken")?;
    let new = arrives(s, &entry, 0x6D5, &value, &value)?;
    ensure(new, format!("{value:02X?} taken with CAN-ID 6D5h"), "the value stays")
}

fn deadline(s: &mut Subject<'_>) -> Outcome {
    let entry = output(s)?;
    let pdo = listening(s, &entry, 255)?;
    s.need(pdo.index, 5)?;
    s.set(pdo.index, 1, pdo.cob_id | OFF)?;
    s.set(pdo.index, 5, 100)?;
    s.switch_on(pdo)?;
    let value = s.read(entry.index, entry.sub)?;
    s.plain_emcy()?;
    let (mark, id) = (s.mark(), 0x80 + s.id());
    s.send(pdo.id(), &value)?;
    let told = s.next(mark, id, 500)?.map(|told| told.frame.data().to_vec()).unwrap_or_default();
    ensure(told.starts_with(&[0x50, 0x82]), "EMCY 8250h", format!("{told:02X?}"))
}
