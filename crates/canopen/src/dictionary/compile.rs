//! From rows to run-time tables, all of it during compilation: the panics here are compile errors.

use super::filling::{Filling, attributes, is_same};
use super::tables::{Pdos, Series};
use super::{Access, Dictionary, Object, Tables, Type, check};
use crate::device::PDOS;

/// How many rows the parts of a table have together.
#[must_use]
pub const fn count(parts: &[&[Object]]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < parts.len() {
        total += parts[i].len();
        i += 1;
    }
    total
}

/// Joins the parts of a table. `N` is what [`count`] says.
///
/// # Panics
/// During compilation, when `N` does not fit.
#[must_use]
pub const fn gather<const N: usize>(parts: &[&[Object]]) -> [Object; N] {
    let mut rows = [Object::new(0, 0, "", Type::Unsigned8, Access::Const); N];
    let (mut part, mut row, mut at) = (0, 0, 0);
    while part < parts.len() {
        if row == parts[part].len() {
            (part, row) = (part + 1, 0);
            continue;
        }
        rows[at] = parts[part][row];
        (row, at) = (row + 1, at + 1);
    }
    assert!(at == N, "N is not the number of rows");
    rows
}

/// The run-time dictionary of a table of rows, after its [`check`](crate::dictionary::check).
#[macro_export]
macro_rules! dictionary {
    ($rows:expr) => {{
        let [dictionary] = $crate::dictionaries!([$rows]);
        dictionary
    }};
}

/// The same of several tables, as an array: what the dictionaries have in common is there once.
#[macro_export]
macro_rules! dictionaries {
    ($all:expr) => {{
        use $crate::dictionary as make;
        // Whatever is behind `$all` must not have one of these names.
        const ROWS_OF_ALL: &[&[make::Object]] = &$all;
        const ROOM: make::Counts = make::Counts::of(ROWS_OF_ALL);
        static COMPILED_TABLES: make::Tables<
            { ROWS_OF_ALL.len() },
            { ROOM.series },
            { ROOM.places },
            { ROOM.attributes },
            { ROOM.defaults },
        > = make::compile(&$all);
        COMPILED_TABLES.dictionaries(&$all)
    }};
}

/// The room that the tables of some dictionaries need.
#[derive(Clone, Copy, Debug)]
pub struct Counts {
    /// Series of objects.
    pub series: usize,
    /// Places of entries.
    pub places: usize,
    /// Different attributes.
    pub attributes: usize,
    /// Bytes of default values.
    pub defaults: usize,
}

impl Counts {
    /// Of the dictionaries of these tables.
    ///
    /// # Panics
    /// During compilation, when a table is wrong: see [`check`](super::check).
    #[must_use]
    pub const fn of(all: &[&[Object]]) -> Counts {
        let mut i = 0;
        while i < all.len() {
            check(all[i]);
            i += 1;
        }
        Filling::of(all).filled
    }
}

/// The run-time tables of tables of rows. The parameters are what [`Counts`] says, or more.
///
/// # Panics
/// During compilation, when they are less.
#[must_use]
pub const fn compile<const D: usize, const S: usize, const P: usize, const A: usize, const V: usize>(
    all: &[&[Object]; D],
) -> Tables<D, S, P, A, V> {
    let Filling { series, places, attributes, defaults, .. } = Filling::of(all);
    let (mut tpdos, mut rpdos, mut i) = ([NO_PDOS; D], [NO_PDOS; D], 0);
    while i < D {
        (tpdos[i], rpdos[i]) = (pdos(all[i], 0x1800), pdos(all[i], 0x1400));
        i += 1;
    }
    Tables {
        series: beginning(&series),
        places: beginning(&places),
        attributes: beginning(&attributes),
        defaults: beginning(&defaults),
        tpdos,
        rpdos,
    }
}

const fn beginning<T: Copy, const N: usize>(all: &[T]) -> [T; N] {
    *all.first_chunk().expect("too many for the tables")
}

impl<const D: usize, const S: usize, const P: usize, const A: usize, const V: usize> Tables<D, S, P, A, V> {
    /// The dictionaries of the tables of rows that these tables were made of.
    ///
    /// # Panics
    /// During compilation, when they were not.
    #[must_use]
    pub const fn dictionaries(&'static self, all: &[&[Object]; D]) -> [Dictionary; D] {
        let Tables { series, places, attributes, defaults, tpdos, rpdos } = self;
        let any = Dictionary { series, places, attributes, defaults, tpdos: &NO_PDOS, rpdos: &NO_PDOS };
        let mut dictionaries = [any; D];
        let (mut i, mut rest): (usize, &'static [Series]) = (0, series);
        while i < D {
            (dictionaries[i].series, rest) = rest.split_at(series_count(all[i]));
            (dictionaries[i].tpdos, dictionaries[i].rpdos) = (&tpdos[i], &rpdos[i]);
            i += 1;
        }
        dictionaries
    }
}

const NO_PDOS: Pdos = Pdos { count: 0, indexes: [0; PDOS] };

/// Of the PDOs whose communication objects are among the 512 indexes from `first` on.
const fn pdos(rows: &[Object], first: u16) -> Pdos {
    let mut pdos = NO_PDOS;
    let mut row = 0;
    while row < rows.len() {
        if rows[row].index & 0xFE00 == first && rows[row].sub == 0 {
            pdos.indexes[pdos.count as usize] = rows[row].index;
            pdos.count += 1;
        }
        row += 1;
    }
    pdos
}

/// The row of the event timer of a TPDO.
///
/// # Panics
/// During compilation, when there is none.
pub(super) const fn event_timer(rows: &[Object], number: u8) -> usize {
    let mut row = 0;
    while rows[row].key() != (0x1800 | number as u32) << 8 | 5 {
        row += 1;
    }
    row
}

/// How many series the objects of a table form.
const fn series_count(rows: &[Object]) -> usize {
    let (mut total, mut row) = (0, 0);
    while row < rows.len() {
        row += object_len(rows, row) * series_len(rows, row);
        total += 1;
    }
    total
}

/// The rows of the object that begins here.
pub(super) const fn object_len(rows: &[Object], first: usize) -> usize {
    let mut end = first + 1;
    while end < rows.len() && rows[end].index == rows[first].index {
        end += 1;
    }
    end - first
}

/// The objects of the series that begins here.
pub(super) const fn series_len(rows: &[Object], first: usize) -> usize {
    let len = object_len(rows, first);
    let mut objects = 1;
    while objects < u8::MAX as usize && continues(rows, first, len, objects) {
        objects += 1;
    }
    objects
}

/// Whether the object after so many of a series is one of it too.
const fn continues(rows: &[Object], first: usize, len: usize, objects: usize) -> bool {
    let start = first + len * objects;
    if start + len > rows.len() || object_len(rows, start) != len {
        return false;
    }
    if rows[start].index as usize != rows[first].index as usize + objects {
        return false;
    }
    let mut i = 0;
    while i < len {
        let (a, b) = (&rows[first + i], &rows[start + i]);
        if a.sub != b.sub || !a.rule.has_place() || !is_same(&attributes(a), &attributes(b)) {
            return false;
        }
        i += 1;
    }
    true
}

pub(super) const fn effective_limits(row: &Object) -> (i64, i64) {
    match (row.limits, row.kind.range()) {
        (Some(limits), _) | (None, Some(limits)) => limits,
        (None, None) => (0, 0),
    }
}

/// Bytes of the image of all values.
#[must_use]
pub const fn image_size(rows: &[Object]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < rows.len() {
        total += rows[i].stored_size();
        i += 1;
    }
    total
}
