//! The run-time tables agree with the rows.

use crate::bench::{DICTIONARY, rows};
use canopen::sdo::Abort;

#[test]
fn every_row_has_its_entry_and_its_place() {
    let mut offset = 0;
    let mut image = vec![0; DICTIONARY.image_size()];
    assert_eq!(rows().count(), DICTIONARY.entries().count());
    for (row, entry) in rows() {
        assert_eq!((row.index, row.sub), (entry.index(), entry.sub()));
        let found = DICTIONARY.find(row.index, row.sub).unwrap();
        assert_eq!(found.field(), entry.field());
        assert_eq!(found.field(), DICTIONARY.field(row.index, row.sub));
        // Each value has its own bytes: after all are marked, no byte is left over.
        let len = entry.field().get(&image).len();
        entry.field().set(&mut image, &vec![0xA5; len]);
        offset += len;
    }
    assert_eq!(image.iter().filter(|&&byte| byte == 0xA5).count(), image.len());
    assert!(offset >= image.len());
}

#[test]
fn missing_objects_and_sub_indices_have_different_codes() {
    for (row, _) in rows() {
        assert_eq!(DICTIONARY.find(row.index, 0xFF).unwrap_err(), Abort::NoSubIndex);
    }
    for index in [0, 0x0FFF, 0x1002, 0x1402, 0x1602, 0x6108, 0x6205, 0xFFFF] {
        assert_eq!(DICTIONARY.find(index, 0).unwrap_err(), Abort::NoObject, "{index:04X}h");
    }
}

#[test]
#[should_panic(expected = "the entry has another type")]
fn an_unsigned_value_is_no_variable_of_a_signed_type() {
    let _ = DICTIONARY.variable::<i16>(0x1015, 0);
}

#[test]
fn a_value_takes_its_own_places_of_the_image() {
    let field = DICTIONARY.field(0x6204, 0);
    let mut image = vec![0; DICTIONARY.image_size()];
    field.set(&mut image, &[0xA5; 8]);
    assert_eq!(image.iter().filter(|&&byte| byte == 0xA5).count(), 8);
    for (place, &byte) in image.iter().enumerate() {
        assert_eq!(field.is_at(place), byte == 0xA5, "{place}");
    }
    assert!(!field.is_at(image.len()) && !field.is_at(usize::MAX));
}

#[test]
fn the_defaults_replace_every_value_of_an_image() {
    let mut image = vec![0xA5; DICTIONARY.image_size()];
    DICTIONARY.load_defaults(&mut image);
    let number = |index, sub| DICTIONARY.field(index, sub).u32(&image);
    assert_eq!((number(0x1000, 0), number(0x1018, 4)), (0x0002_0194, 0x8000_0005));
    assert_eq!(number(0x1014, 0), 0x80, "without the node-ID");
    assert_eq!(DICTIONARY.field(0x1017, 0).u16(&image), 1000);
    assert_eq!(DICTIONARY.field(0x1008, 0).get(&image), b"a name of twenty-six chars\0\0\0\0\0\0");
    assert_eq!((number(0x6000, 1), DICTIONARY.field(0x6204, 0).u64(&image)), (0, 0), "no default is 0");
}
