//! Tests of the whole list.

use canopen::dictionary::{DefaultValue, Object};

use super::*;

/// Bytes of a row's default value, `len` bytes long.
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
    for personality in Personality::ALL {
        let (rows, dictionary) = (personality.rows(), personality.dictionary());
        let mut image = vec![0xA5; dictionary.image_size()];
        dictionary.load_defaults(&mut image);
        assert_eq!(dictionary.entries().count(), rows.len());
        for (row, entry) in rows.iter().zip(dictionary.entries()) {
            assert_eq!((entry.index(), entry.sub()), (row.index, row.sub));
            assert_eq!(entry.field(), dictionary.field(row.index, row.sub));
            let value = entry.field().get(&image);
            // The error list (1003h) and the alias of an event timer (6200h) have no values of their own.
            let has_value = row.index != 0x1003 && row.index != 0x6200;
            assert!(!has_value || value == default(row, value.len()), "{:04X}h:{}", row.index, row.sub);
        }
    }
}

#[test]
fn numbers_are_places_in_the_list() {
    for (place, personality) in (0..).zip(Personality::ALL) {
        assert_eq!((personality.number(), Personality::numbered(place)), (place, Some(personality)));
    }
    assert_eq!(Personality::numbered(Personality::ALL.len().try_into().unwrap()), None);
}

#[test]
fn every_personality_has_its_own_fields() {
    for personality in Personality::ALL {
        let mut image = vec![0; IMAGE_SIZE];
        personality.dictionary().load_defaults(&mut image);
        let parameters = AnyProfile::new(personality).parameters(&image);
        let mut measurement = Measurement::new(personality, &board::PowerOn::default());
        assert_eq!(measurement.sample(&inputs()), Snapshot::Nothing, "before there are parameters");
        measurement.apply(&parameters);
        assert_ne!(measurement.sample(&inputs()), Snapshot::Nothing);
    }
}

fn inputs() -> board::Inputs {
    let analogue =
        board::RawSample { pressure: 1, supply: 2, temperature: 3, reference: 4, thermistor: 5, count: 1 };
    board::Inputs { analogue, position: board::RawEncoder::default(), digital: [false; 2] }
}
