//! PDOs that the library's device can have: a default that it cannot is switched off, with a note.

use canopen::CobId;
use canopen::dictionary::{DefaultValue, Object, Type};

use super::node::ROOM;
use super::rows::Rows;

/// Bit 31 of a COB-ID: the PDO is off.
const OFF: i64 = 1 << 31;
/// Bit 30 of a COB-ID: no remote frames.
const NO_REMOTE: u32 = 1 << 30;
/// Transmission type of events.
const EVENT: i64 = 255;

/// Repairs all PDOs of the rows.
pub(super) fn repair(all: &mut Rows) {
    for (first, room) in [(0x1400, ROOM.rpdos), (0x1800, ROOM.tpdos)] {
        let indexes: Vec<u16> = (first..first + 0x200).filter(|pdo| has_any(all, *pdo)).collect();
        for (rank, pdo) in indexes.into_iter().enumerate() {
            match why_not(all, pdo, rank < room) {
                Some(why) => leave_out(all, pdo, why),
                None => repair_one(all, pdo),
            }
        }
    }
}

/// Whether there is a communication or a mapping parameter.
fn has_any(all: &Rows, pdo: u16) -> bool {
    all.rows.contains_key(&(pdo, 0)) || all.rows.contains_key(&(pdo | 0x200, 0))
}

fn why_not(all: &Rows, pdo: u16, has_room: bool) -> Option<&'static str> {
    let has = |index, sub| all.rows.contains_key(&(index, sub));
    match () {
        () if !has_room => Some("left out: a simulated device has 64 PDOs of each direction"),
        () if !has(pdo, 1) => Some("left out: the PDO has no COB-ID"),
        () if !has(pdo, 2) => Some("left out: the PDO has no transmission type"),
        () if !has(pdo | 0x200, 0) => Some("left out: the PDO has no mapping parameter"),
        () => None,
    }
}

fn leave_out(all: &mut Rows, pdo: u16, why: &str) {
    all.rows.retain(|(index, _), _| *index & !0x200 != pdo);
    all.note((pdo, 0), why);
}

fn repair_one(all: &mut Rows, pdo: u16) {
    let mapped = mapped(all, pdo);
    let is_sent = pdo & 0x800 != 0;
    let has_sync = all.rows.contains_key(&(0x1005, 0));
    let transmission = number(all, (pdo, 2));
    let is_known = match transmission {
        0..=240 => has_sync,
        252 | 253 => is_sent,
        254 | 255 => true,
        _ => false,
    };
    if !is_known {
        set(all, (pdo, 2), EVENT);
        all.note((pdo, 2), "the default is 255: the device does not know this transmission type");
    }
    let base = match all.rows[&(pdo, 1)].default {
        DefaultValue::NodeId(base) => Some(base),
        DefaultValue::Integer(value) => u32::try_from(value).ok(),
        _ => None,
    };
    let wrong = match base.and_then(CobId::parse) {
        None => Some("the PDO is off: its CAN-ID has more than 11 bits"),
        Some(id) if id.bit31 => None,
        Some(_) if is_reserved(all, pdo) => {
            Some("the PDO is off: its CAN-ID is reserved for another service")
        }
        Some(_) => mapped.err(),
    };
    if mapped.is_err() || wrong.is_some() {
        clear(all, pdo, mapped.is_err());
    }
    if let Some(wrong) = wrong {
        all.note((pdo, 1), wrong);
    }
    // Remote frames are needed for 252 and 253.
    if matches!(transmission, 252 | 253)
        && let DefaultValue::NodeId(base) = all.rows[&(pdo, 1)].default
    {
        set_default(all, (pdo, 1), DefaultValue::NodeId(base & !NO_REMOTE));
    } else if matches!(transmission, 252 | 253) {
        let value = number(all, (pdo, 1));
        set(all, (pdo, 1), value & !i64::from(NO_REMOTE));
    }
}

/// Switches a PDO off. A wrong mapping becomes empty.
fn clear(all: &mut Rows, pdo: u16, is_mapping_wrong: bool) {
    let off = match all.rows[&(pdo, 1)].default {
        DefaultValue::NodeId(base) if CobId::parse(base).is_some() => DefaultValue::NodeId(base | 1 << 31),
        _ => DefaultValue::Integer(OFF),
    };
    set_default(all, (pdo, 1), off);
    if is_mapping_wrong {
        let keys: Vec<_> =
            all.rows.range((pdo | 0x200, 0)..=(pdo | 0x200, 254)).map(|(key, _)| *key).collect();
        keys.into_iter().for_each(|key| set(all, key, 0));
    }
}

/// Whether the CAN-ID is one of another service, for any node-ID.
fn is_reserved(all: &Rows, pdo: u16) -> bool {
    let ids = match all.rows[&(pdo, 1)].default {
        DefaultValue::NodeId(base) => [base.wrapping_add(1), base.wrapping_add(127)],
        DefaultValue::Integer(value) => [u32::try_from(value).unwrap_or(0); 2],
        _ => [0; 2],
    };
    ids.into_iter().any(|id| CobId::parse(id).is_none_or(|id| id.id.is_restricted()))
}

/// Whether the default mapping is one that the library can process. Unused slots are cleared, where they map nothing.
fn mapped(all: &mut Rows, pdo: u16) -> Result<(), &'static str> {
    let mapping = pdo | 0x200;
    let count = number(all, (mapping, 0));
    let is_sent = pdo & 0x800 != 0;
    let mut bits = 0;
    let slots: Vec<_> = all.rows.range((mapping, 1)..=(mapping, 254)).map(|(key, _)| *key).collect();
    for key in slots {
        let value = u32::try_from(number(all, key)).unwrap_or(0);
        match size(all, value, is_sent) {
            Some(size) if i64::from(key.1) <= count => bits += size,
            None if i64::from(key.1) <= count => {
                return Err("the PDO is off: it maps an object that is not there, or a part of one");
            }
            None => set(all, key, 0),
            Some(_) => (),
        }
    }
    match count {
        0 => Err("the PDO is off: it maps no object"),
        65.. => Err("the PDO is off: it is multiplexed"),
        _ if bits > 64 => Err("the PDO is off: it has more than eight bytes"),
        _ if (1..=count).any(|sub| !all.rows.contains_key(&(mapping, u8::try_from(sub).unwrap_or(0)))) => {
            Err("the PDO is off: it maps more objects than it has entries")
        }
        _ => Ok(()),
    }
}

/// The length of a mapped object in bits; `None` where the object is not there, or cannot be mapped with this length.
fn size(all: &Rows, mapped: u32, is_sent: bool) -> Option<u32> {
    let [bits, sub, low, high] = mapped.to_le_bytes();
    let index = u16::from_le_bytes([low, high]);
    let dummy = match index {
        0x02 | 0x05 => 8,
        0x03 | 0x06 => 16,
        0x04 | 0x07 => 32,
        _ => 0,
    };
    if !is_sent && dummy != 0 && sub == 0 {
        return (u32::from(bits) == dummy).then_some(dummy);
    }
    let row: &Object = all.rows.get(&(index, sub))?;
    let allows = if is_sent { row.mapping.allows_tpdo() } else { row.mapping.allows_rpdo() };
    (allows && bits == row.kind.size().saturating_mul(8)).then_some(bits.into())
}

fn number(all: &Rows, key: (u16, u8)) -> i64 {
    match all.rows.get(&key).map(|row| row.default) {
        Some(DefaultValue::Integer(value)) => value,
        _ => 0,
    }
}

fn set(all: &mut Rows, key: (u16, u8), value: i64) {
    set_default(all, key, DefaultValue::Integer(value));
}

fn set_default(all: &mut Rows, key: (u16, u8), default: DefaultValue) {
    if let Some(row) = all.rows.get_mut(&key) {
        row.default = default;
        // The limits of the data sheet were for its default.
        row.limits = row.limits.filter(|_| matches!(row.kind, Type::Unsigned16));
    }
}
