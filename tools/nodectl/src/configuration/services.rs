//! The steps of services outside of PDOs whose objects depend on each other (CiA 301, 7.5.2).

use super::Configuration;
use super::plan::{Key, Write, write};
use crate::object::at;
use crate::value::Value;

/// 1006h, the period of SYNC, and 1019h, its counter.
const PERIOD: Key = (0x1006, 0);
const COUNTER: Key = (0x1019, 0);
/// 1016h, the nodes whose heartbeat is monitored.
const CONSUMER: u16 = 0x1016;
/// The sub-indexes of 1016h.
const WATCHES: std::ops::RangeInclusive<u8> = 1..=127;

/// The COB-ID with its service switched off. The CAN-ID of a service changes only while it is off. `None` for an entry
/// that is no such COB-ID.
pub(super) fn off((index, sub): Key, cob_id: i128) -> Option<i128> {
    match (index, sub) {
        // Bit 30: the device produces SYNC.
        (0x1005, 0) => Some(cob_id & !(1 << 30)),
        // Bit 30: the device produces the time stamp; bit 31: it consumes it.
        (0x1012, 0) => Some(cob_id & !(3 << 30)),
        // Bit 31 switches EMCY, the EMCY of another node, SDO channels and PDOs off.
        (0x1014, 0) | (0x1028, 1..) | (0x1200..=0x12FF, 1 | 2) | (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => {
            Some(cob_id | 1 << 31)
        }
        _ => None,
    }
}

/// The number of an object; `None` without a number.
pub(super) fn number(of: &Configuration, key: Key) -> Option<i128> {
    match of.values.get(&key)? {
        Value::Integer(number) => Some(*number),
        _ => None,
    }
}

/// The index by which the objects of a service are ordered: those of SYNC are one service.
pub(super) fn service(index: u16) -> u16 {
    if matches!(index, 0x1006 | 0x1019) { 0x1005 } else { index }
}

/// The objects that the steps to an object look at, beside the object.
pub(super) fn companions(index: u16) -> Vec<Key> {
    match index {
        0x1019 => vec![PERIOD],
        CONSUMER => WATCHES.map(|sub| (CONSUMER, sub)).collect(),
        _ => Vec::new(),
    }
}

/// The steps to the changed objects of a service: first what makes their change possible, then the changes.
pub(super) fn steps(changed: &[Key], from: &Configuration, to: &Configuration) -> Vec<Write> {
    let cob_ids = changed.iter().filter_map(|key| switch_off(*key, from, to));
    let mut steps: Vec<Write> = cob_ids.chain(double_watches(changed, from, to)).collect();
    let mut writes: Vec<Write> = changed.iter().filter_map(|key| write(to, *key)).collect();
    if let Some(period) = number(from, PERIOD).filter(|period| *period != 0 && changed.contains(&COUNTER)) {
        steps.push(integer(PERIOD, 0));
        if !changed.contains(&PERIOD) {
            writes.push(integer(PERIOD, period));
        }
    }
    // The counter, the period, and then the production of SYNC.
    writes.sort_by_key(|write| match write.at.index {
        0x1006 => 1,
        0x1005 => 2,
        _ => 0,
    });
    writes.retain(|write| !steps.contains(write));
    steps.extend(writes);
    steps
}

fn integer(key: Key, value: i128) -> Write {
    Write { at: at(key.0, key.1), value: Value::Integer(value) }
}

/// Switches a service off whose CAN-ID changes.
fn switch_off(key: Key, from: &Configuration, to: &Configuration) -> Option<Write> {
    let (present, wanted) = (number(from, key)?, number(to, key)?);
    let is_off = off(key, present)?;
    (present != is_off && off(key, wanted) != Some(is_off)).then(|| integer(key, is_off))
}

/// Clears the entries of 1016h whose node another entry is to monitor: a device monitors a node once.
fn double_watches(changed: &[Key], from: &Configuration, to: &Configuration) -> Vec<Write> {
    let watched = |of, key| number(of, key).and_then(node);
    let keys = changed.iter().copied().filter(|key| key.0 == CONSUMER);
    let wanted: Vec<(Key, i128)> = keys.filter_map(|key| Some((key, watched(to, key)?))).collect();
    let is_double = |key: &Key| {
        let is_free = changed.contains(key) || !to.values.contains_key(key);
        let present = watched(from, *key).filter(|_| is_free);
        wanted.iter().any(|(other, node)| other != key && present == Some(*node))
    };
    WATCHES.map(|sub| (CONSUMER, sub)).filter(is_double).map(|key| integer(key, 0)).collect()
}

/// The node in a value of 1016h; `None` for an unused entry.
fn node(value: i128) -> Option<i128> {
    let node = value >> 16 & 0xFF;
    (value & 0xFFFF != 0 && (1..=127).contains(&node)).then_some(node)
}
