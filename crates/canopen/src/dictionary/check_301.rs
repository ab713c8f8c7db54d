//! Checks of a table at compile time beyond what the code at run time relies on: entries of CiA 301 that a test of
//! conformance would refuse.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use super::compile::find;
use super::fail::require;
use super::{DefaultValue, Object, Rule, Type};

/// Checks a table that [`check`](super::check()) accepts: the entries that the device itself reads or writes have their
/// size, a constant sub-index 0 is the highest sub-index, and node guarding has both of its entries.
///
/// ```compile_fail
/// use canopen::dictionary::{Access, Dictionary, Object, Type};
///
/// const ROWS: &[Object] = &[Object::new(0x1001, 0, "Error register", Type::Unsigned32, Access::ReadOnly)];
/// // evaluation panicked: 1001h:0: the entry of CiA 301 has a type of another size
/// static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
/// ```
///
/// # Panics
/// During compilation, when a row is wrong. The message begins with index and sub-index of the row.
pub const fn check_301(rows: &[Object]) {
    let mut i = 0;
    while i < rows.len() {
        let row = &rows[i];
        check_size(row);
        check_highest(rows, i);
        let is_guarding = matches!(row.rule, Rule::GuardTime | Rule::LifeTimeFactor);
        let is_paired = !is_guarding || find(rows, 0x100C, 0).is_some() && find(rows, 0x100D, 0).is_some();
        require!(is_paired, row, "node guarding needs 100Ch and 100Dh");
        i += 1;
    }
}

const fn check_size(row: &Object) {
    let fits = match (row.index, row.sub) {
        (0x1000, 0) | (0x1018, 1..=4) => row.kind.size() == 4,
        (0x1001 | 0x1029, _) => row.kind.size() == 1,
        _ => true,
    };
    require!(fits, row, "the entry of CiA 301 has a type of another size");
}

const fn check_highest(rows: &[Object], at: usize) {
    let (row, mut last) = (&rows[at], at);
    if row.sub != 0 || !matches!(row.rule, Rule::Plain) || row.access.is_writable() {
        return;
    }
    while last + 1 < rows.len() && rows[last + 1].index == row.index {
        last += 1;
    }
    if let (true, Type::Unsigned8, DefaultValue::Integer(value)) = (last > at, row.kind, row.default) {
        // An application that sets the number itself leaves the default 0.
        let is_highest = value == 0 || value == rows[last].sub as i64;
        require!(is_highest, row, "sub-index 0 is not the highest sub-index of the object");
    }
}
