//! The rows of the second device, made from the rows of the stand-alone device.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use super::SHIFT;
use canopen::dictionary::Object;

/// The rows with their indexes shifted. `N` is the number of rows.
pub(super) const fn shifted<const N: usize>(rows: &[Object]) -> [Object; N] {
    let mut out = [row(&rows[0]); N];
    let mut i = 0;
    while i < N {
        out[i] = row(&rows[i]);
        i += 1;
    }
    out
}

/// One shifted row. A unit that names an index is shifted too.
const fn row(row: &Object) -> Object {
    let unit = if matches!(row.unit.as_bytes(), b"6131h") { "6931h" } else { row.unit };
    let mut shifted = *row;
    (shifted.index, shifted.unit) = (row.index + SHIFT, unit);
    shifted
}
