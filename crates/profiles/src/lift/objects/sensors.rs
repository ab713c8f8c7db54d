//! The position sensors of the lift: objects 2100h to 2106h, as in the encoder.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use crate::encoder;
use canopen::dictionary::Object;

/// The encoder's rows that describe sensors. The rows after them belong to CiA 406.
pub(super) const OBJECTS: &[Object] = before(encoder::objects::SENSORS, 0x2107);

const fn before(rows: &'static [Object], index: u16) -> &'static [Object] {
    let mut count = 0;
    while count < rows.len() && rows[count].index < index {
        count += 1;
    }
    rows.split_at(count).0
}
