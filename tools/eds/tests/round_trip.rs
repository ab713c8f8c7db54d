//! Tests that a written data sheet, read again, agrees with its table.

use canopen::NodeId;
use eds::{Access, DEVICES, Edition, Eds, Flags, Formula, ObjectType, Value};
use profiles::Personality;
use profiles::product::{REVISION, VENDOR_ID};

fn pressure() -> Eds {
    Eds::parse(&DEVICES[0].sheet(&Edition::default())).unwrap()
}

fn default(eds: &Eds, index: u16, sub: u8) -> Value {
    let formula = eds.get(index, sub).and_then(|entry| entry.default.clone());
    formula.unwrap().evaluate(NodeId::new(5).unwrap())
}

#[test]
fn every_device_reads_back() {
    for device in &DEVICES {
        let mut written = device.eds().clone();
        // Units are comments, which the reader skips.
        for entry in written.objects.values_mut().flat_map(|object| object.entries.values_mut()) {
            entry.unit.clear();
        }
        assert_eq!(Eds::parse(&device.sheet(&Edition::default())).unwrap(), written, "{}", device.file_name);
    }
}

#[test]
fn every_row_has_its_entry() {
    for device in &DEVICES {
        let eds = device.eds();
        let keys: Vec<_> = eds.entries().map(|entry| (entry.index, entry.sub)).collect();
        let rows: Vec<_> = device.rows.iter().map(|row| (row.index, row.sub)).collect();
        assert_eq!(keys, rows, "{}", device.file_name);
    }
}

#[test]
fn the_identity_is_that_of_the_node() {
    let eds = pressure();
    let product = Personality::Pressure.product_code();
    for (sub, value) in [(1, VENDOR_ID), (2, product), (3, REVISION)] {
        assert_eq!(default(&eds, 0x1018, sub), Value::Integer(value.into()), "1018h:{sub}");
    }
    assert_eq!(eds.get(0x1018, 4).unwrap().default, None);
    assert_eq!((eds.device.vendor_number, eds.device.product_number), (VENDOR_ID, product));
    assert_eq!(eds.device.revision_number, REVISION);
}

#[test]
fn the_device_has_eight_pdos_each_way_and_every_bit_rate() {
    let device = pressure().device;
    assert_eq!((device.rpdos, device.tpdos, device.granularity), (8, 8, 8));
    assert_eq!(device.bit_rates.into_iter().collect::<Vec<_>>(), [10, 20, 50, 125, 250, 500, 800, 1000]);
    assert!(device.lss && !device.group_messaging);
}

#[test]
fn identifiers_count_from_the_node_id() {
    let eds = pressure();
    assert_eq!(default(&eds, 0x1014, 0), Value::Integer(0x85));
    assert_eq!(default(&eds, 0x1800, 1), Value::Integer(0x185));
    assert_eq!(default(&eds, 0x1801, 1), Value::Integer(0x8000_0285));
    assert_eq!(default(&eds, 0x1005, 0), Value::Integer(0x80));
}

#[test]
fn object_types_follow_the_rule() {
    let eds = pressure();
    for (index, object_type) in [
        (0x1000, ObjectType::Var),
        (0x1003, ObjectType::Array),
        (0x1018, ObjectType::Record),
        (0x1800, ObjectType::Record),
        (0x1A00, ObjectType::Record),
        (0x6130, ObjectType::Array),
    ] {
        assert_eq!(eds.objects[&index].object_type, object_type, "{index:04X}h");
    }
}

#[test]
fn an_entry_has_the_attributes_of_its_row() {
    let eds = pressure();
    let entry = eds.get(0x1019, 0).unwrap();
    assert_eq!((&entry.name[..], entry.access), ("Synchronous counter overflow value", Access::ReadWrite));
    assert_eq!((entry.data_type.0, entry.mappable), (5, false));
    let limit = |value| Some(Formula::Constant(Value::Integer(value)));
    assert_eq!((&entry.low, &entry.high), (&limit(0), &limit(240)));
    let entry = eds.get(0x6130, 1).unwrap();
    assert!(entry.is_tpdo_mappable() && !entry.is_rpdo_mappable());
    assert_eq!(default(&eds, 0x6148, 2), Value::Real(-40.0));
}

#[test]
fn the_text_is_ascii_with_dos_line_ends() {
    for device in &DEVICES {
        let sheet = device.sheet(&Edition::default());
        assert!(sheet.is_ascii() && sheet.ends_with("\r\n"));
        assert_eq!(sheet.matches('\n').count(), sheet.matches("\r\n").count());
        assert!(sheet.lines().all(|line| line.len() < 255), "CiA 306 allows 255 characters");
    }
}

/// Entries that a configuration leaves out: commands, what makes the device act, and the calibration.
#[test]
fn commands_are_excluded_from_a_download_and_stored_values_are_not() {
    for device in &DEVICES {
        let eds = Eds::parse(&device.sheet(&Edition::default())).unwrap();
        for row in device.rows.iter().filter(|row| row.access.is_writable()) {
            let flags = eds.get(row.index, row.sub).unwrap().flags.unwrap();
            let acts = matches!(
                row.index,
                0x1003 | 0x1010 | 0x1011 | 0x1F51 | 0x2000 | 0x2108 | 0x2109 | 0x2213 | 0x2200
                    ..=0x2204
                        | 0x2322
                        | 0x2F00
                        | 0x6003
                        | 0x2005
                        | 0x6010
                        | 0x6125
                        | 0x6139
                        | 0x6382
                        | 0x6486
                        | 0x650E
                        | 0x6610
                        | 0x6611
                        | 0x6925
                        | 0x6939
                        | 0x6D0E
                        | 0x6E10
                        | 0x6E11
            );
            let acts = acts
                || matches!((row.index, row.sub), (0x2002, 2) | (0x2003, 3))
                || matches!((row.index, row.sub, row.group), (0x6011 | 0x6200, 0, None));
            assert_eq!(flags.refuse_write(), acts, "{} {:04X}h:{}", device.file_name, row.index, row.sub);
        }
        // A domain, and a list that is empty most of the time.
        for (index, sub) in [(0x2F00, 0), (0x1003, 1)] {
            assert!(
                eds.get(index, sub).unwrap().flags.is_some_and(Flags::refuse_read),
                "{}",
                device.file_name
            );
        }
    }
}

/// Editors write `ObjFlags=0` for every entry without a thought.
#[test]
fn flags_count_only_where_the_author_has_used_them() {
    let sheet = DEVICES[0].sheet(&Edition::default());
    let zeros = sheet.replace("ObjFlags=0x1", "ObjFlags=0x0");
    assert!(Eds::parse(&zeros).unwrap().entries().all(|entry| entry.flags.is_none()));
    let wrong = sheet.replacen("ObjFlags=0x1", "ObjFlags=often", 1);
    assert!(Eds::parse(&wrong).is_ok());
}
