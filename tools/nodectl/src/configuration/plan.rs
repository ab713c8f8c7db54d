//! The order in which parameters are written, so that the device accepts them.

use std::collections::BTreeSet;

use canopen::sdo::Multiplexer;

use super::Configuration;
use crate::object::at;
use crate::value::Value;

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

/// The writes that bring a device from one configuration to another. Parameters outside of PDOs come first. Then come
/// the PDOs with differences, each in five steps (CiA 301, 7.5.2.36): off, mapping empty, mapping, number of entries,
/// on.
#[must_use]
pub fn plan(from: &Configuration, to: &Configuration) -> Vec<Write> {
    let changed: Vec<(u16, u8)> =
        from.changes(to).iter().map(|change| (change.at.index, change.at.sub)).collect();
    let is_pdo = |index: u16| (0x1400..=0x1BFF).contains(&index);
    let others = changed.iter().filter(|key| !is_pdo(key.0)).filter_map(|key| write(to, *key));
    // The mapping of 1400h is at 1600h, and the mapping of 1800h is at 1A00h.
    let pdos: BTreeSet<u16> = changed.iter().filter(|key| is_pdo(key.0)).map(|key| key.0 & !0x0200).collect();
    let steps = pdos.into_iter().flat_map(|pdo| pdo_steps(pdo, &changed, from, to));
    others.chain(steps).collect()
}

fn write(to: &Configuration, key: (u16, u8)) -> Option<Write> {
    Some(Write { at: at(key.0, key.1), value: to.values.get(&key)?.clone() })
}

fn pdo_steps(pdo: u16, changed: &[(u16, u8)], from: &Configuration, to: &Configuration) -> Vec<Write> {
    let (cob_id, mapping) = ((pdo, 1), pdo | 0x0200);
    let wanted = to.values.get(&cob_id).or_else(|| from.values.get(&cob_id));
    let Some(Value::Integer(wanted)) = wanted else { return Vec::new() };
    let mut steps = vec![Write { at: at(pdo, 1), value: Value::Integer(wanted | OFF) }];
    if changed.iter().any(|key| key.0 == mapping) {
        steps.extend(mapping_steps(mapping, changed, from, to));
    }
    steps.extend(changed.iter().filter(|key| key.0 == pdo && key.1 > 1).filter_map(|key| write(to, *key)));
    if wanted & OFF == 0 {
        steps.push(Write { at: at(pdo, 1), value: Value::Integer(*wanted) });
    }
    steps
}

/// The steps of the mapping: clear it, write each object, write their number.
fn mapping_steps(
    mapping: u16,
    changed: &[(u16, u8)],
    from: &Configuration,
    to: &Configuration,
) -> Vec<Write> {
    let key = (mapping, 0);
    let count = match to.values.get(&key).or_else(|| from.values.get(&key)) {
        Some(Value::Integer(count)) => *count,
        _ => 0,
    };
    let used = if count > SLOTS { 0 } else { count };
    let is_written = |key: &&(u16, u8)| i128::from(key.1) <= used || changed.contains(key);
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
        let plan = plan(&configuration(&[]), &configuration(changes));
        let step = |write: &Write| match write.value {
            Value::Integer(value) => (write.at.index, write.at.sub, value),
            _ => panic!("{write:?}"),
        };
        plan.iter().map(step).collect()
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
    }
}
