//! Tables of rows, combined during compilation: every panic here is a compile error.
#![allow(clippy::indexing_slicing, clippy::expect_used, reason = "evaluated by the compiler")]

use canopen::dictionary::{Access, Object, Rule, Type};

/// Largest number of parts in a table.
const PARTS: usize = 40;

/// Number of rows in all parts together.
#[must_use]
pub const fn count(all: &[&[&[Object]]]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < all.len() {
        let mut part = 0;
        while part < all[i].len() {
            total += all[i][part].len();
            part += 1;
        }
        i += 1;
    }
    total
}

/// Merges parts, each sorted by index and sub-index, into one sorted table. `N` must be the result of [`count`].
///
/// # Panics
/// During compilation, if `N` is another number or there are too many parts.
#[must_use]
pub const fn merged<const N: usize>(all: &[&[&[Object]]]) -> [Object; N] {
    let (mut rests, len) = flat(all);
    let mut rows = [Object::new(0, 0, "", Type::Unsigned8, Access::Const); N];
    let mut at = 0;
    while at < N {
        let first = lowest(&rests, len);
        let (row, rest) = rests[first].split_first().expect("N is not the number of rows");
        (rows[at], rests[first]) = (*row, rest);
        at += 1;
    }
    assert!(count(all) == N, "N is not the number of rows");
    rows
}

/// The parts in one list, and their number.
const fn flat<'a>(all: &[&'a [&'a [Object]]]) -> ([&'a [Object]; PARTS], usize) {
    let (mut parts, mut len, mut i): ([&[Object]; PARTS], usize, usize) = ([&[]; PARTS], 0, 0);
    while i < all.len() {
        let mut part = 0;
        while part < all[i].len() {
            parts[len] = all[i][part];
            (len, part) = (len + 1, part + 1);
        }
        i += 1;
    }
    (parts, len)
}

/// The part whose next row comes first; any part when no row is left.
const fn lowest(parts: &[&[Object]; PARTS], len: usize) -> usize {
    let (mut lowest, mut i) = (0, 0);
    while i < len {
        if key(parts[i]) < key(parts[lowest]) {
            lowest = i;
        }
        i += 1;
    }
    lowest
}

const fn key(rows: &[Object]) -> u32 {
    match rows.first() {
        Some(row) => (row.index as u32) << 8 | row.sub as u32,
        None => u32::MAX,
    }
}

/// The larger of two sizes.
#[must_use]
pub const fn larger(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// Whether the application decides on writes to the object of the row.
#[must_use]
pub const fn is_handled(row: &Object) -> bool {
    matches!(row.rule(), Rule::Application) && !matches!(row.kind, Type::Domain)
}

/// The storage groups that a table has rows of, one bit for each.
#[must_use]
pub const fn groups(rows: &[Object]) -> u8 {
    let mut groups = 0;
    let mut i = 0;
    while i < rows.len() {
        if let Some(group) = rows[i].group {
            groups |= 1 << group as u8;
        }
        i += 1;
    }
    groups
}
