//! Checks of a table of rows at compile time. The code at run time relies on them. A panic here is a compile error.
#![allow(clippy::indexing_slicing, clippy::panic, reason = "evaluated by the compiler")]

use super::compile::{effective_limits, event_timer};
use super::{Access, DefaultValue, Mapping, Object, Rule, Type, image_size};
use crate::sdo::BUFFER;

/// Checks a table: the rows are sorted, no entry occurs twice, every default has the type of its entry and is within
/// its limits, every object has sub-index 0, and the attributes of a row fit together.
///
/// # Panics
/// During compilation, when a row is wrong.
pub const fn check(rows: &[Object]) {
    assert!(image_size(rows) <= u16::MAX as usize, "the image outgrows its offsets");
    let mut i = 0;
    while i < rows.len() {
        check_row(&rows[i]);
        if i > 0 {
            assert!(rows[i - 1].key() < rows[i].key(), "rows are not sorted, or one is there twice");
        }
        let has_sub_0 = rows[i].sub == 0 || (i > 0 && rows[i - 1].index == rows[i].index);
        assert!(has_sub_0, "an object has no sub-index 0");
        assert!(rows[i].sub < u8::MAX, "an object has more entries than a series can");
        let is_pdo = matches!(rows[i].index, 0x1400..=0x15FF | 0x1800..=0x19FF);
        assert!(!is_pdo || rows[i].sub > 0 || has(rows, rows[i].key() | 1), "a PDO has no COB-ID");
        if let Rule::EventTimerOf(number) = rows[i].rule {
            let timer = &rows[event_timer(rows, number)];
            assert!(
                matches!(timer.access, Access::ReadWrite),
                "an event timer is written under its other name"
            );
            assert!(timer.limits.is_none() && rows[i].limits.is_none(), "an event timer has no limits");
        }
        i += 1;
    }
}

const fn has(rows: &[Object], key: u32) -> bool {
    let mut i = 0;
    while i < rows.len() && rows[i].key() != key {
        i += 1;
    }
    i < rows.len()
}

const fn check_row(row: &Object) {
    check_limits(row);
    match (row.default, row.kind) {
        (DefaultValue::Integer(value), _) => {
            let (low, high) = effective_limits(row);
            assert!(
                row.kind.range().is_some() && low <= value && value <= high,
                "the default is out of range"
            );
        }
        (DefaultValue::Real(value), Type::Real32) => {
            assert!(value.is_finite(), "the default is not a number");
        }
        (DefaultValue::Text(text), Type::VisibleString(capacity)) => {
            assert!(capacity as usize <= BUFFER, "an SDO transfer has no room for the text");
            assert!(text.is_ascii() && text.len() <= capacity as usize, "the default does not fit");
        }
        (DefaultValue::NodeId(_), Type::Unsigned32) | (DefaultValue::None, Type::Domain) => (),
        _ => panic!("the default is of another type"),
    }
    let mappable = !matches!(row.mapping, Mapping::No);
    let fits = row.kind.size() >= 1 && row.kind.size() <= 8;
    assert!(!mappable || fits, "a mapped object has no place in a PDO");
    assert!(!mappable || row.stored_size() > 0, "a mapped object has no place in the image");
    // A read-only value can be stored too, such as the offset that the device computes from a preset.
    let lasts = matches!(row.access, Access::ReadWrite | Access::ReadOnly);
    assert!(row.group.is_none() || lasts, "only a parameter or what the device has found can be stored");
    assert!(!row.mapping.allows_tpdo() || row.access.is_readable(), "a TPDO sends what can be read");
    assert!(!row.mapping.allows_rpdo() || row.access.is_writable(), "an RPDO writes what can be written");
    let takes_values = matches!(row.rule, Rule::Plain | Rule::Application);
    assert!(!row.mapping.allows_rpdo() || takes_values, "an RPDO writes no object of the protocol");
    if let Some(size) = row.rule.size() {
        assert!(row.kind.size() == size, "the object has another type");
    }
    let is_time = matches!(row.kind, Type::Unsigned16) && row.group.is_none();
    assert!(
        !matches!(row.rule, Rule::EventTimerOf(_)) || is_time,
        "an event timer is saved under its own index"
    );
    let listed = matches!(row.rule, Rule::ErrorCount | Rule::ErrorEntry);
    assert!(!listed || row.index == 0x1003, "the error list is object 1003h");
}

const fn check_limits(row: &Object) {
    if let Some((low, high)) = row.limits {
        let Some((min, max)) = row.kind.range() else { panic!("limits of what is not an integer") };
        assert!(min <= low && low <= high && high <= max, "limits are wider than the type");
        assert!(row.kind.size() <= 4, "limits of more than 32 bits are not checked");
    }
}
