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
    let mut parts = Parts::new(all);
    let mut rows = [Object::new(0, 0, "", Type::Unsigned8, Access::Const); N];
    let mut at = 0;
    while at < N {
        rows[at] = parts.take_lowest();
        at += 1;
    }
    assert!(count(all) == N, "N is not the number of rows");
    rows
}

/// The rows of all parts that are not in the table yet.
struct Parts<'a> {
    rests: [&'a [Object]; PARTS],
    /// The key of the first row of each rest; the highest number for an empty one.
    keys: [u32; PARTS],
    len: usize,
}

impl<'a> Parts<'a> {
    const fn new(all: &[&'a [&'a [Object]]]) -> Parts<'a> {
        let mut parts = Parts { rests: [&[]; PARTS], keys: [u32::MAX; PARTS], len: 0 };
        let mut i = 0;
        while i < all.len() {
            let mut part = 0;
            while part < all[i].len() {
                parts.set(parts.len, all[i][part]);
                (parts.len, part) = (parts.len + 1, part + 1);
            }
            i += 1;
        }
        parts
    }

    const fn set(&mut self, part: usize, rest: &'a [Object]) {
        self.rests[part] = rest;
        self.keys[part] = match rest.first() {
            Some(row) => row.key(),
            None => u32::MAX,
        };
    }

    /// Takes the row that comes first.
    const fn take_lowest(&mut self) -> Object {
        let (mut lowest, mut key, mut i) = (0, self.keys[0], 1);
        while i < self.len {
            if self.keys[i] < key {
                (lowest, key) = (i, self.keys[i]);
            }
            i += 1;
        }
        let (row, rest) = self.rests[lowest].split_first().expect("N is not the number of rows");
        self.set(lowest, rest);
        *row
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
