//! The order in which parameters are written, so that the device accepts them.

use std::collections::{BTreeMap, BTreeSet};

use canopen::sdo::Multiplexer;

use super::{Configuration, services};
use crate::object::at;
use crate::value::Value;

/// Index and sub-index.
pub(super) type Key = (u16, u8);

/// A write.
#[derive(Clone, Debug, PartialEq)]
pub struct Write {
    /// The parameter.
    pub at: Multiplexer,
    /// The new value.
    pub value: Value,
}

/// Bit 31 of a COB-ID: the PDO is switched off.
const OFF: i128 = 1 << 31;
/// A larger number of entries stands for a multiplexed PDO (CiA 301, 7.5.2.36).
const SLOTS: i128 = 64;

/// The objects that are written together, in the order in which they are written.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Group {
    /// A service, or another object, by its index.
    Service(u16),
    /// A PDO, by the index of its communication parameter.
    Pdo(u16),
    /// 1020h: a device clears the date of its configuration with each change.
    Date,
}

impl Group {
    fn of(index: u16) -> Group {
        match index {
            0x1020 => Group::Date,
            0x1400..=0x1BFF => Group::Pdo(pdo_of(index)),
            _ => Group::Service(services::service(index)),
        }
    }
}

/// The writes that bring a device from one configuration to another. Parameters outside of PDOs come first, with the
/// steps that their services need: off before another CAN-ID, 1006h = 0 before another 1019h, no node twice in 1016h. Then
/// come the PDOs with differences, each in five steps (CiA 301, 7.5.2.36): off, mapping empty, mapping, number of entries,
/// on. The date of the configuration comes last.
#[must_use]
pub fn plan(from: &Configuration, to: &Configuration) -> Vec<Write> {
    let mut groups: BTreeMap<Group, Vec<Key>> = BTreeMap::new();
    for change in from.changes(to) {
        let key = (change.at.index, change.at.sub);
        groups.entry(Group::of(key.0)).or_default().push(key);
    }
    let steps = |(group, changed): (Group, Vec<Key>)| match group {
        Group::Pdo(pdo) => pdo_steps(pdo, &changed, from, to),
        Group::Service(_) | Group::Date => services::steps(&changed, from, to),
    };
    groups.into_iter().flat_map(steps).collect()
}

/// The objects that [`plan`] looks at on the way to a configuration: its own, and those on which its steps depend.
#[must_use]
pub fn looked_at(to: &Configuration) -> BTreeSet<(u16, u8)> {
    let companions = |index: u16| match Group::of(index) {
        Group::Pdo(pdo) => vec![(pdo, 1), (pdo | 0x0200, 0)],
        Group::Service(_) | Group::Date => services::companions(index),
    };
    let indexes: BTreeSet<u16> = to.values.keys().map(|key| key.0).collect();
    to.values.keys().copied().chain(indexes.into_iter().flat_map(companions)).collect()
}

/// The mapping of 1400h is at 1600h, and the mapping of 1800h is at 1A00h.
fn pdo_of(index: u16) -> u16 {
    index & !0x0200
}

pub(super) fn write(to: &Configuration, key: Key) -> Option<Write> {
    Some(Write { at: at(key.0, key.1), value: to.values.get(&key)?.clone() })
}

fn pdo_steps(pdo: u16, changed: &[Key], from: &Configuration, to: &Configuration) -> Vec<Write> {
    let (cob_id, mapping) = ((pdo, 1), pdo | 0x0200);
    let present = services::number(from, cob_id);
    let Some(wanted) = services::number(to, cob_id).or(present) else { return Vec::new() };
    // Off with the present CAN-ID, which changes only while the PDO is off.
    let off = present.unwrap_or(wanted) | OFF;
    let mut steps = vec![Write { at: at(pdo, 1), value: Value::Integer(off) }];
    if changed.iter().any(|key| key.0 == mapping) {
        steps.extend(mapping_steps(mapping, changed, from, to));
    }
    steps.extend(changed.iter().filter(|key| key.0 == pdo && key.1 > 1).filter_map(|key| write(to, *key)));
    if wanted != off {
        steps.push(Write { at: at(pdo, 1), value: Value::Integer(wanted) });
    }
    steps
}

/// The steps of the mapping: clear it, write each object, write their number.
fn mapping_steps(mapping: u16, changed: &[Key], from: &Configuration, to: &Configuration) -> Vec<Write> {
    let key = (mapping, 0);
    let count = match to.values.get(&key).or_else(|| from.values.get(&key)) {
        Some(Value::Integer(count)) => *count,
        _ => 0,
    };
    let used = if count > SLOTS { 0 } else { count };
    let is_written = |key: &&Key| i128::from(key.1) <= used || changed.contains(key);
    let slots = to.values.keys().filter(|key| key.0 == mapping && key.1 > 0).filter(is_written);
    let empty = Write { at: at(mapping, 0), value: Value::Integer(0) };
    let full = Write { at: at(mapping, 0), value: Value::Integer(count) };
    std::iter::once(empty).chain(slots.filter_map(|key| write(to, *key))).chain([full]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Catalogue;

    fn configuration(changes: &[(u16, u8, i128)]) -> Configuration {
        let node = canopen::NodeId::new(5).expect("a node-ID");
        let catalogue = Catalogue::of_file("pressure.eds").expect("a data sheet");
        let mut configuration = Configuration::of_sheet(catalogue.sheet(), node);
        for &(index, sub, value) in changes {
            configuration.values.insert((index, sub), Value::Integer(value));
        }
        configuration
    }

    fn steps(changes: &[(u16, u8, i128)]) -> Vec<(u16, u8, i128)> {
        numbers(&plan(&configuration(&[]), &configuration(changes)))
    }

    fn numbers(writes: &[Write]) -> Vec<(u16, u8, i128)> {
        let number = |write: &Write| match write.value {
            Value::Integer(value) => (write.at.index, write.at.sub, value),
            _ => panic!("{write:?}"),
        };
        writes.iter().map(number).collect()
    }

    #[test]
    fn equal_configurations_need_nothing() {
        assert_eq!(steps(&[]), []);
    }

    #[test]
    fn a_pdo_is_changed_in_five_steps_after_all_else() {
        let changes = [(0x1A00, 0, 1), (0x1A00, 1, 0x7130_0110), (0x1800, 2, 1), (0x6132, 1, 2)];
        let expected = [
            (0x6132, 1, 2),
            (0x1800, 1, 0x8000_0185),
            (0x1A00, 0, 0),
            (0x1A00, 1, 0x7130_0110),
            (0x1A00, 0, 1),
            (0x1800, 2, 1),
            (0x1800, 1, 0x185),
        ];
        assert_eq!(steps(&changes), expected);
    }

    #[test]
    fn a_pdo_that_is_to_be_off_stays_off() {
        assert_eq!(steps(&[(0x1800, 1, 0x8000_0185)]), [(0x1800, 1, 0x8000_0185)]);
        let other = [(0x1800, 1, 0x8000_0185), (0x1800, 1, 0x8000_01A0)];
        assert_eq!(steps(&other[1..]), other, "the CAN-ID changes while the PDO is off");
    }

    #[test]
    fn the_counter_of_sync_is_written_before_its_period_and_its_production_last() {
        let changes = [(0x1005, 0, 0x4000_0090), (0x1006, 0, 1000), (0x1019, 0, 10), (0x1017, 0, 500)];
        let expected = [(0x1019, 0, 10), (0x1006, 0, 1000), (0x1005, 0, 0x4000_0090), (0x1017, 0, 500)];
        assert_eq!(steps(&changes), expected);
        let (from, to) = (configuration(&changes), configuration(&[(0x1006, 0, 1000), (0x1017, 0, 500)]));
        let back = [(0x1005, 0, 0x90), (0x1006, 0, 0), (0x1019, 0, 0), (0x1006, 0, 1000), (0x1005, 0, 0x80)];
        assert_eq!(numbers(&plan(&from, &to)), back);
    }

    #[test]
    fn a_monitored_node_is_cleared_only_where_another_entry_is_to_have_it() {
        let (one, two) = ((0x1016, 1, 0x0006_0100), (0x1016, 2, 0x0007_0100));
        let from = configuration(&[one, two]);
        let later = [(0x1016, 1, 0x0006_0200), two];
        assert_eq!(numbers(&plan(&from, &configuration(&later))), later[..1]);
        let moved = [(0x1016, 1, 0x0007_0100), (0x1016, 2, 0)];
        assert_eq!(numbers(&plan(&from, &configuration(&moved))), [moved[1], moved[0]]);
    }

    #[test]
    fn the_date_of_the_configuration_is_written_last() {
        let changes = [(0x1020, 1, 15_000), (0x1800, 1, 0x8000_0185), (0x6132, 1, 2)];
        assert_eq!(steps(&changes), [changes[2], changes[1], changes[0]]);
    }
}
