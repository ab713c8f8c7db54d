//! COB-IDs that follow the node-ID: those of the pre-defined connection set (CiA 301, 7.3.5).
//!
//! A configuration is copied from node to node. A COB-ID that equals the pre-defined one of its node must become that
//! of the other node, else two nodes send with one CAN-ID. A file has such a COB-ID as `$NODEID+...` (CiA 306).

use canopen::NodeId;
use eds::{Entry, Formula};

use crate::value::Value;

/// The CAN-ID in a COB-ID.
const CAN_ID: i128 = 0x7FF;
/// Bit 29 of a COB-ID: the CAN-ID has 29 bits.
const EXTENDED: i128 = 1 << 29;

/// The formula for a COB-ID that follows the node-ID; `None` for any other value.
pub(super) fn formula(entry: &Entry, value: &Value, node: NodeId) -> Option<Formula> {
    let Value::Integer(value) = *value else { return None };
    let node = i128::from(node.get());
    let follows = value & EXTENDED == 0 && value & CAN_ID == pre_defined(entry)? + node;
    follows.then_some(Formula::NodeId(value - node))
}

/// The pre-defined CAN-ID of an entry without the node-ID: that of the data sheet, else that of CiA 301. `None` for an
/// entry that is no COB-ID, and for a COB-ID without a pre-defined CAN-ID.
fn pre_defined(entry: &Entry) -> Option<i128> {
    let number = i128::from(entry.index & 0x1FF);
    let (is_cob_id, base) = match (entry.index, entry.sub) {
        (0x1014, 0) => (true, Some(0x080)),
        (0x1400..=0x15FF, 1) => (true, Some(0x200 + 0x100 * number).filter(|_| number < 4)),
        (0x1800..=0x19FF, 1) => (true, Some(0x180 + 0x100 * number).filter(|_| number < 4)),
        _ => (false, None),
    };
    match entry.default {
        Some(Formula::NodeId(default)) if is_cob_id => Some(default & CAN_ID),
        _ => base,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Catalogue;

    fn formula_of(index: u16, sub: u8, value: i128, node: u8) -> Option<Formula> {
        let catalogue = Catalogue::of_file("pressure.eds").expect("a data sheet");
        let entry = catalogue.entry(crate::object::at(index, sub)).expect("an entry");
        formula(entry, &Value::Integer(value), NodeId::new(node).expect("a node-ID"))
    }

    #[test]
    fn a_pre_defined_cob_id_follows_the_node_id_with_its_flags() {
        for node in [1, 16, 127] {
            let id = i128::from(node);
            for (index, sub, base) in
                [(0x1800, 1, 0x180), (0x1801, 1, 0x280), (0x1400, 1, 0x200), (0x1014, 0, 0x80)]
            {
                for flags in [0, 1 << 30, 1 << 31, 3 << 30] {
                    let formula = formula_of(index, sub, flags | (base + id), node.try_into().unwrap());
                    assert_eq!(formula, Some(Formula::NodeId(flags | base)), "{index:04X}h of node {node}");
                }
            }
        }
    }

    #[test]
    fn any_other_cob_id_stays() {
        // The CAN-ID of another PDO or of another node, 29 bits, and objects that are no COB-ID.
        for (index, sub, value) in [
            (0x1800, 1, 0x286),
            (0x1800, 1, 0x186),
            (0x1400, 1, 0x185),
            (0x1800, 1, 0x2000_0185),
            (0x1804, 1, 0x585),
            (0x1017, 0, 0x185),
            (0x1A00, 1, 0x185),
        ] {
            assert_eq!(formula_of(index, sub, value, 5), None, "{index:04X}h:{sub} {value:X}");
        }
    }
}
