//! Checks of the default of each PDO at compile time: a PDO that is wrong would be silent at run time.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // `check_row` has verified the ranges.

use super::compile::find;
use super::fail::{fail, require};
use super::{Addressing, DefaultValue, MappedObject, Object, Rule, Transmission};
use crate::CobId;

/// The objects that describe a PDO. In both directions, the mapping parameter has bit 9 set.
const MAPPING: u16 = 0x0200;

/// Checks the row at a position, if it is the first row of a communication parameter or of a mapping parameter.
pub(super) const fn check_pdo_row(rows: &[Object], at: usize) {
    let row = &rows[at];
    match row.index {
        0x1400..=0x15FF | 0x1800..=0x19FF if row.sub == 0 => check_communication(rows, row),
        0x1600..=0x17FF | 0x1A00..=0x1BFF if row.sub == 0 => check_mapping(rows, at),
        _ => (),
    }
}

const fn is_sent(row: &Object) -> bool {
    row.index & 0x0800 != 0
}

const fn check_communication(rows: &[Object], row: &Object) {
    let Some(id) = find(rows, row.index, 1) else {
        fail(row.index, 1, "the PDO has no COB-ID");
    };
    let Some(kind) = find(rows, row.index, 2) else {
        fail(row.index, 2, "the PDO has no transmission type");
    };
    let Some(count) = find(rows, row.index | MAPPING, 0) else {
        fail(row.index | MAPPING, 0, "the PDO has no mapping parameter");
    };
    let (id, kind, count) = (&rows[id], &rows[kind], &rows[count]);
    let Some(transmission) = Transmission::parse(default_byte(kind)) else {
        fail(kind.index, 2, "the transmission types 241 to 251 are reserved");
    };
    require!(
        !transmission.is_synchronous() || find(rows, 0x1005, 0).is_some(),
        kind,
        "the transmission type needs SYNC, and the table has no 1005h",
    );
    let needs_remote = transmission.needs_remote();
    require!(is_sent(row) || !needs_remote, kind, "an RPDO has no transmission type 252 or 253");
    let (Some(first), Some(last)) = of_first_and_last(id.default) else {
        fail(id.index, 1, "the COB-ID has a CAN-ID of more than 11 bits");
    };
    if first.bit31 {
        return;
    }
    let is_own = matches!(id.rule, Rule::PdoPredefined);
    let is_free = !first.id.is_restricted() && !last.id.is_restricted();
    require!(is_own || is_free, id, "the CAN-ID is reserved for another service");
    require!(!first.bit30 || !needs_remote, kind, "the transmission type needs remote frames");
    let mapped = default_byte(count);
    require!(mapped > 0, count, "the PDO is valid, but maps no object");
    let is_multiplexed = Addressing::from_count(mapped).is_some();
    require!(
        !is_multiplexed || transmission.is_event_driven(),
        kind,
        "a multiplexed PDO has the transmission type 254 or 255",
    );
}

/// The COB-IDs with the lowest and with the highest node-ID.
pub(super) const fn of_first_and_last(default: DefaultValue) -> (Option<CobId>, Option<CobId>) {
    let (first, last) = match default {
        DefaultValue::NodeId(base) => (base.wrapping_add(1), base.wrapping_add(127)),
        DefaultValue::Integer(value) => (value as u32, value as u32),
        _ => (0, 0),
    };
    (CobId::parse(first), CobId::parse(last))
}

/// Checks the mapping entries: each maps an object in this direction with its length, and together the mapped objects
/// have eight bytes at most.
const fn check_mapping(rows: &[Object], at: usize) {
    let row = &rows[at];
    let has_parameter = find(rows, row.index & !MAPPING, 0).is_some();
    require!(has_parameter, row, "the mapping parameter has no communication parameter");
    let mut count = default_byte(row);
    if Addressing::from_count(count).is_some() {
        count = 0;
    }
    require!(count <= 64, row, "a PDO maps at most 64 objects");
    // The mapping entries follow in the order of their sub-indexes.
    let (mut slot, mut entries, mut bits) = (at + 1, 0, 0);
    while slot < rows.len() && rows[slot].index == row.index {
        let is_used = rows[slot].sub <= count;
        let mapped = check_slot(rows, &rows[slot], is_used);
        (entries, bits) = if is_used { (entries + 1, bits + mapped as u32) } else { (entries, bits) };
        slot += 1;
    }
    if entries < count {
        let mut missing = 1;
        while find(rows, row.index, missing).is_some() {
            missing += 1;
        }
        fail(row.index, missing, "the PDO maps more objects than it has entries");
    }
    require!(bits <= 64, row, "the mapped objects have more than eight bytes");
}

/// Checks a mapping entry. Returns the length of the object in bits.
const fn check_slot(rows: &[Object], slot: &Object, is_used: bool) -> u8 {
    let value = match slot.default {
        DefaultValue::Integer(value) => value as u32,
        _ => 0,
    };
    if value == 0 && !is_used {
        return 0;
    }
    let mapped = MappedObject::parse(value);
    if !is_sent(slot)
        && let Some(size) = mapped.dummy_size()
    {
        require!(mapped.bits == size * 8, slot, "the dummy object has another length");
        return mapped.bits;
    }
    let Some(object) = find(rows, mapped.index, mapped.sub) else {
        fail(slot.index, slot.sub, "the mapped object is not in the table");
    };
    let object = &rows[object];
    let allows = if is_sent(slot) { object.mapping.allows_tpdo() } else { object.mapping.allows_rpdo() };
    require!(allows, slot, "the mapped object cannot be mapped in this direction");
    require!(
        mapped.bits as u16 == object.kind.size() as u16 * 8,
        slot,
        "the mapped object has another length",
    );
    mapped.bits
}

/// The default of an entry of type UNSIGNED8.
const fn default_byte(row: &Object) -> u8 {
    match row.default {
        DefaultValue::Integer(value) => value as u8,
        _ => 0,
    }
}
