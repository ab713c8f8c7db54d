//! The dictionaries of all personalities, compiled together: what they have in common is in the image once.

use crate::{combined, encoder, lift, pressure};
use canopen::dictionary::{Dictionary, Object};

/// The tables of all personalities, in the order of their numbers.
pub(crate) const TABLES: [&[Object]; 4] =
    [&pressure::OBJECTS, &encoder::OBJECTS, &combined::OBJECTS, &lift::OBJECTS];

static ALL: [Dictionary; TABLES.len()] = canopen::dictionaries!(TABLES);

pub(crate) const PRESSURE: &Dictionary = &ALL[0];
pub(crate) const ENCODER: &Dictionary = &ALL[1];
pub(crate) const COMBINED: &Dictionary = &ALL[2];
pub(crate) const LIFT: &Dictionary = &ALL[3];

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec;
    use std::vec::Vec;

    use super::*;
    use canopen::dictionary::DefaultValue;

    /// Bytes of the default value of a row, as long as its place.
    fn default(row: &Object, len: usize) -> Vec<u8> {
        let mut bytes = match row.default {
            DefaultValue::Integer(value) => value.to_le_bytes().to_vec(),
            DefaultValue::Real(value) => value.to_le_bytes().to_vec(),
            DefaultValue::NodeId(base) => base.to_le_bytes().to_vec(),
            DefaultValue::Text(text) => text.as_bytes().to_vec(),
            DefaultValue::None => Vec::new(),
        };
        bytes.resize(len, 0);
        bytes
    }

    #[test]
    fn every_row_has_its_entry_and_its_default() {
        for (rows, dictionary) in TABLES.into_iter().zip(&ALL) {
            let mut image = vec![0xA5; dictionary.image_size()];
            dictionary.load_defaults(&mut image);
            assert_eq!(dictionary.entries().count(), rows.len());
            for (row, entry) in rows.iter().zip(dictionary.entries()) {
                assert_eq!((entry.index(), entry.sub()), (row.index, row.sub));
                assert_eq!(entry.field(), dictionary.field(row.index, row.sub));
                let value = entry.field().get(&image);
                // An error list and the other name of an event timer have no values of their own.
                let has_value = row.index != 0x1003 && row.index != 0x6200;
                assert!(!has_value || value == default(row, value.len()), "{:04X}h:{}", row.index, row.sub);
            }
        }
    }
}
