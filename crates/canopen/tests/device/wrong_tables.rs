//! A wrong table does not compile. `check` is a constant function: here it runs with the test, and its message is the
//! compile error.

use canopen::dictionary::{
    Access, DefaultValue, Group, Mapping, Object, TableBuilder, Type, check, check_301,
};
use canopen::objects;

const INPUT: Object =
    Object::new(0x6000, 0, "Input", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
const OUTPUT: Object =
    Object::new(0x6200, 0, "Output", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo);

/// A row with a change that its methods do not offer.
fn changed(mut row: Object, change: impl FnOnce(&mut Object)) -> Object {
    change(&mut row);
    row
}

/// The compile error of a table of these rows; `None` for a table that compiles.
fn compile_error(parts: &[&[Object]]) -> Option<String> {
    let mut rows = parts.concat();
    rows.sort_by_key(Object::key);
    message_of(move || {
        check(&rows);
        check_301(&rows);
    })
}

/// The message of a panic; `None` without a panic.
fn message_of(run: impl FnOnce() + std::panic::UnwindSafe) -> Option<String> {
    let payload = std::panic::catch_unwind(run).err()?;
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    Some(text.or_else(|| payload.downcast_ref().cloned()).expect("a message"))
}

#[track_caller]
fn assert_error(parts: &[&[Object]], message: &str) {
    assert_eq!(compile_error(parts).as_deref(), Some(message));
}

#[test]
fn a_pdo_maps_only_objects_of_the_table() {
    assert_eq!(compile_error(&[&objects::tpdo(1, &[INPUT]), &[INPUT]]), None);
    assert_error(&[&objects::tpdo(1, &[INPUT])], "1A00h:1: the mapped object is not in the table");
    assert_error(&[&objects::rpdo(300, &[OUTPUT])], "172Bh:1: the mapped object is not in the table");
}

#[test]
fn a_mapped_object_has_the_length_of_its_row() {
    let wide = changed(INPUT, |row| row.kind = Type::Unsigned16);
    assert_error(&[&objects::tpdo(2, &[INPUT]), &[wide]], "1A01h:1: the mapped object has another length");
    let dummy = [objects::pdo::slot(0x1600, 1, 0x0005_0010)];
    let mut rows = objects::rpdo(1, &[OUTPUT]);
    rows[5] = dummy[0];
    assert_error(&[&rows, &[OUTPUT]], "1600h:1: the dummy object has another length");
}

#[test]
fn a_mapped_object_is_mappable_in_the_direction_of_the_pdo() {
    let message = "1A00h:1: the mapped object cannot be mapped in this direction";
    let unmapped = INPUT.mappable(Mapping::No);
    assert_error(&[&objects::tpdo(1, &[INPUT]), &[unmapped]], message);
    let message = "1600h:1: the mapped object cannot be mapped in this direction";
    assert_error(&[&objects::rpdo(1, &[OUTPUT]), &[OUTPUT.mappable(Mapping::Tpdo)]], message);
}

#[test]
fn an_unused_mapping_entry_is_checked_too() {
    let mut rows = objects::tpdo(1, &[INPUT]);
    rows[14] = rows[14].value(0x6001_0008);
    assert_error(&[&rows, &[INPUT]], "1A00h:8: the mapped object is not in the table");
}

#[test]
fn a_reserved_transmission_type_does_not_compile() {
    for kind in [241, 251] {
        let rows = objects::with(objects::tpdo(1, &[INPUT]), 2, kind);
        assert_error(&[&rows, &[INPUT]], "1800h:2: the transmission types 241 to 251 are reserved");
    }
    for kind in [0, 1, 240, 252, 253, 254, 255] {
        let rows = objects::with(objects::tpdo(1, &[INPUT]), 2, kind);
        assert_eq!(compile_error(&[&rows, &objects::sync_consumer(), &[INPUT]]), None);
    }
    let rows = objects::with(objects::tpdo(1, &[INPUT]), 2, 1);
    let message = "1800h:2: the transmission type needs SYNC, and the table has no 1005h";
    assert_error(&[&rows, &[INPUT]], message);
    let rows = objects::with(objects::rpdo(1, &[OUTPUT]), 2, 253);
    assert_error(&[&rows, &[OUTPUT]], "1400h:2: an RPDO has no transmission type 252 or 253");
}

#[test]
fn a_valid_pdo_can_be_sent() {
    let mut rows = objects::tpdo(1, &[]);
    rows[1] = rows[1].default(DefaultValue::NodeId(0x180));
    assert_error(&[&rows], "1A00h:0: the PDO is valid, but maps no object");
    rows[1] = rows[1].default(DefaultValue::Integer(0x601));
    assert_error(&[&rows], "1800h:1: the CAN-ID is reserved for another service");
    rows[1] = rows[1].default(DefaultValue::Integer(0x800));
    assert_error(&[&rows], "1800h:1: the COB-ID has a CAN-ID of more than 11 bits");
    let mut rows = objects::with(objects::tpdo(1, &[INPUT]), 2, 253);
    rows[1] = rows[1].default(DefaultValue::NodeId(0x4000_0180));
    assert_error(&[&rows, &[INPUT]], "1800h:2: the transmission type needs remote frames");
}

#[test]
fn a_pdo_has_all_its_rows() {
    let rows = objects::tpdo(1, &[INPUT]);
    let all = |missing: usize| [&rows[..missing], &rows[missing + 1..], &[INPUT]].concat();
    assert_error(&[&all(1)], "1800h:1: the PDO has no COB-ID");
    assert_error(&[&rows[..1]], "1800h:1: the PDO has no COB-ID");
    assert_error(&[&all(2)], "1800h:2: the PDO has no transmission type");
    assert_error(&[&all(7)], "1A00h:1: the PDO maps more objects than it has entries");
    assert_error(&[&rows[..6]], "1A00h:0: the PDO has no mapping parameter");
    assert_error(&[&rows[6..], &[INPUT]], "1A00h:0: the mapping parameter has no communication parameter");
}

#[test]
fn mapped_objects_are_not_longer_than_a_pdo() {
    let long = changed(INPUT, |row| (row.index, row.kind) = (0x6001, Type::Unsigned64));
    let mut rows = objects::tpdo(1, &[INPUT]);
    rows[6] = rows[6].value(2);
    rows[8] = rows[8].value(0x6001_0040);
    assert_error(&[&rows, &[INPUT, long]], "1A00h:0: the mapped objects have more than eight bytes");
}

#[test]
fn an_entry_of_cia_301_keeps_its_service() {
    let message =
        "1017h:0: the entry would lose its service: no handled(), setting() and the like for this index";
    assert_error(&[&[objects::heartbeat_producer(1000).handled()]], message);
    let setting = Object::new(0x1019, 0, "", Type::Unsigned8, Access::ReadWrite).setting();
    let message =
        "1019h:0: the entry would lose its service: no handled(), setting() and the like for this index";
    assert_error(&[&[setting]], message);
    // A rule cannot move to another index either.
    let moved = changed(objects::heartbeat_producer(0), |row| row.index = 0x2000);
    let message =
        "2000h:0: the entry would lose its service: no handled(), setting() and the like for this index";
    assert_error(&[&[moved]], message);
    // The application of a bootloader controls the program.
    let [highest, control] = objects::program_control();
    assert_eq!(compile_error(&[&[highest, control.handled()]]), None);
}

#[test]
fn an_error_names_the_row() {
    let row = |sub| Object::new(0x20AF, sub, "", Type::Unsigned8, Access::ReadWrite);
    assert_error(&[&[row(0).value(256)]], "20AFh:0: the default is out of range");
    assert_error(&[&[row(0), row(130).limits(5, 4)]], "20AFh:130: the lower limit is above the upper one");
    assert_error(&[&[row(0), row(15).limits(0, 256)]], "20AFh:15: the limits are wider than the type");
    assert_error(&[&[row(1)]], "20AFh:1: the object has no sub-index 0");
    let other = Object::new(0x20AE, 0, "", Type::Unsigned8, Access::ReadWrite);
    assert_error(&[&[other, row(1)]], "20AFh:1: the object has no sub-index 0");
    assert_error(&[&[row(0), row(0)]], "20AFh:0: the row is there twice");
    assert_error(&[&[row(0).real(1.0)]], "20AFh:0: the default is of another type than the entry");
    let timer = Object::new(0x20AF, 0, "", Type::Unsigned16, Access::ReadWrite).event_timer_of(0);
    assert_error(&[&[timer]], "20AFh:0: the TPDO has no event timer (sub-index 5)");
}

#[test]
fn a_missing_field_is_named() {
    let message = |index, sub| {
        let error = std::panic::catch_unwind(move || crate::bench::DICTIONARY.field(index, sub)).unwrap_err();
        error.downcast_ref::<String>().cloned()
    };
    assert_eq!(message(0x2FFF, 1).as_deref(), Some("2FFFh:1: no such object in the dictionary"));
    assert_eq!(message(0x6000, 9).as_deref(), Some("6000h:9: no such sub-index in the dictionary"));
    assert_eq!(message(0xFFFF, 0).as_deref(), Some("FFFFh:0: no such object in the dictionary"));
    let error = std::panic::catch_unwind(|| objects::with(objects::rpdo(1, &[]), 3, 1)).unwrap_err();
    let message = error.downcast_ref::<String>().map(String::as_str);
    assert_eq!(message, Some("1400h:3: the object has no such row"));
}

#[test]
fn a_service_needs_all_its_rows() {
    let message = "1202h:0: further SDO servers begin at 1201h and have no gap";
    assert_error(&[&objects::sdo_server(3)], message);
    assert_eq!(compile_error(&[&objects::sdo_server(2), &objects::sdo_server(3)]), None);
    let more = Object::new(0x1028, 128, "", Type::Unsigned32, Access::ReadWrite).value(1 << 31);
    let message = "1028h:128: the sub-index is a node-ID, 1 to 127";
    assert_error(&[&objects::emcy_consumer::<2>(), &[more]], message);
    let ninth = Object::new(0x1010, 9, "", Type::Unsigned32, Access::ReadWrite);
    let message = "1010h:9: storage groups of a product have the sub-indexes 4 to 8";
    assert_error(&[&objects::store_parameters(), &[ninth]], message);
    let own = Object::new(0x2000, 0, "", Type::Unsigned8, Access::ReadWrite).stored(Group::Own6);
    assert_error(
        &[&objects::store_parameters(), &[own]],
        "2000h:0: 1010h has no sub-index for the storage group",
    );
    let heartbeat = Object::new(0x1017, 0, "", Type::Unsigned8, Access::ReadWrite);
    assert_error(&[&[heartbeat]], "1017h:0: the service of the entry needs a type of another size");
}

#[test]
fn the_attributes_of_a_row_fit_together() {
    let row = |kind, access| Object::new(0x2000, 0, "", kind, access);
    let write_only = row(Type::Unsigned8, Access::WriteOnly);
    let text = |text| row(Type::VisibleString(3), Access::Const).default(DefaultValue::Text(text));
    let cases = [
        (write_only.stored(Group::Application), "a constant or a command cannot be stored"),
        (write_only.mappable(Mapping::Tpdo), "a TPDO cannot carry a write-only object"),
        (
            row(Type::Domain, Access::ReadWrite).mappable(Mapping::Both),
            "a mappable object has one to eight bytes",
        ),
        (text("four"), "the default is longer than the string"),
        (text("\u{e4}"), "the default is not ASCII"),
        (row(Type::Real32, Access::ReadWrite).limits(0, 1), "only an integer has limits"),
        (
            row(Type::Unsigned64, Access::ReadWrite).limits(0, 1),
            "an integer of more than 32 bits has no limits",
        ),
        (row(Type::Real32, Access::ReadWrite).real(f32::NAN), "the default is infinite or not a number"),
        (row(Type::Real32, Access::ReadWrite).value(1), "the default is an integer, the entry is not"),
    ];
    for (row, message) in cases {
        assert_error(&[&[row]], &format!("2000h:0: {message}"));
    }
    let last = changed(row(Type::Unsigned8, Access::ReadWrite), |row| row.sub = 255);
    let message = "2000h:255: an object has at most 255 entries, 0 to 254";
    assert_error(&[&[row(Type::Unsigned8, Access::ReadWrite), last]], message);
}

/// Values that an SDO client could not write are no defaults either.
#[test]
fn the_cob_id_of_a_service_can_be_used() {
    let taken = "the CAN-ID is reserved for another service";
    let emcy = Object::new(0x1014, 0, "", Type::Unsigned32, Access::ReadWrite);
    assert_error(&[&[emcy]], &format!("1014h:0: {taken}"));
    assert_eq!(compile_error(&[&[emcy.value(0x8000_0000)]]), None);
    // 100h for node-ID 1, and 17Eh for 127.
    assert_error(&[&[emcy.default(DefaultValue::NodeId(0xFF))]], &format!("1014h:0: {taken}"));
    let wide = "1014h:0: the COB-ID has a CAN-ID of more than 11 bits";
    assert_error(&[&[emcy.value(0x2000_0085)]], wide);
    let mut rows = objects::sync_producer(1000);
    rows[0] = rows[0].value(0x4000_0000);
    assert_error(&[&rows], &format!("1005h:0: {taken}"));
    let mut rows = objects::sync_consumer();
    rows[0] = rows[0].value(0x4000_0080);
    let message = "1005h:0: the rows are those of a consumer of SYNC, and the default makes it a producer";
    assert_error(&[&rows], message);
}

#[test]
fn an_entry_without_any_use_does_not_compile() {
    let watches = objects::heartbeat_consumer::<4>();
    let gap: Vec<Object> = watches.into_iter().filter(|row| row.sub != 2).collect();
    assert_error(&[&gap], "1016h:3: the heartbeats to monitor have no gap");
    let mut errors = objects::error_field::<4>();
    errors[0] = errors[0].stored(Group::Communication);
    assert_error(&[&errors], "1003h:0: an entry without a value in the image cannot be stored");
    let relative =
        Object::new(0x2000, 0, "", Type::Unsigned32, Access::ReadWrite).default(DefaultValue::NodeId(0x180));
    let message = "2000h:0: a default with the node-ID belongs to the communication parameters";
    assert_error(&[&[relative]], message);
    assert_error(&[&[relative.stored(Group::Application)]], message);
    assert_eq!(compile_error(&[&[relative.stored(Group::Communication)]]), None);
    let long = Object::new(0x2000, 0, "", Type::OctetString(200), Access::ReadWrite);
    assert_error(&[&[long]], "2000h:0: the string is longer than an SDO transfer can be");
}

/// A variable of a product, at an index from 2000h on.
fn variable(at: usize, kind: Type) -> Object {
    Object::new(0x2000 + u16::try_from(at).unwrap(), 0, "", kind, Access::ReadWrite)
}

/// The compile error of the run-time tables.
fn table_error(all: &[&[Object]]) -> Option<String> {
    let all: Vec<Vec<Object>> = all.iter().map(|rows| rows.to_vec()).collect();
    let build = move || {
        let all: Vec<&[Object]> = all.iter().map(Vec::as_slice).collect();
        let _ = TableBuilder::checked(&all);
    };
    message_of(build)
}

#[test]
fn values_beyond_the_largest_image_do_not_compile() {
    let text = |count| (0..count).map(|at| variable(at, Type::OctetString(50))).collect::<Vec<_>>();
    assert_eq!(compile_error(&[&text(1310)]), None, "65500 bytes");
    assert_error(&[&text(1311)], "251Eh:0: the values of the table take more than 65535 bytes");
}

#[test]
fn more_heartbeats_than_nodes_do_not_compile() {
    let mut rows = objects::heartbeat_consumer::<128>().to_vec();
    assert_eq!(compile_error(&[&rows]), None);
    rows.push(changed(rows[127], |row| row.sub = 128));
    assert_error(&[&rows], "1016h:128: at most 127 heartbeats are monitored");
}

#[test]
fn too_many_series_of_objects_do_not_compile() {
    // No object follows the one before, so each is a series of its own.
    let apart = |count: usize| (0..count).map(|at| variable(2 * at, Type::Unsigned8)).collect::<Vec<_>>();
    assert_eq!(table_error(&[&apart(1024)]), None);
    let message = "2800h:0: the tables have more than 1024 series of objects that differ in their index only";
    assert_eq!(table_error(&[&apart(1025)]).as_deref(), Some(message));
    assert!(table_error(&[&apart(1000), &apart(25)]).is_some(), "all tables count together");
}

#[test]
fn too_many_shapes_of_objects_do_not_compile() {
    // Each object has one entry more than the one before.
    let records = |count: u16| {
        let entry = |index: u16, sub: u8| Object::new(index, sub, "", Type::Unsigned8, Access::ReadWrite);
        (0..count)
            .flat_map(|at| (0..=at as u8).map(move |sub| entry(0x2000 + at, 2 * sub)))
            .collect::<Vec<_>>()
    };
    let mut fitting = records(44);
    fitting.extend((0..34).map(|sub| Object::new(0x3000, sub, "", Type::Unsigned16, Access::ReadWrite)));
    let twice = fitting.clone();
    assert_eq!(table_error(&[&fitting, &twice]), None, "990 + 34 entries, and the same again");
    let message = "202Ch:0: the objects have more than 1024 entries, those of equal objects counted once";
    assert_eq!(table_error(&[&records(46)]).as_deref(), Some(message));
}

#[test]
fn too_many_kinds_of_entries_do_not_compile() {
    let limited = |count: usize| {
        let limits = (0..count).map(|at| variable(at, Type::Unsigned16).limits(0, at as i64));
        limits.collect::<Vec<_>>()
    };
    assert_eq!(table_error(&[&limited(256)]), None);
    let message =
        "2100h:0: the entries have more than 256 combinations of type, access, limits and other attributes";
    assert_eq!(table_error(&[&limited(257)]).as_deref(), Some(message));
}

#[test]
fn too_many_default_values_do_not_compile() {
    let texts = |letter: &str| {
        let text: &'static str = letter.repeat(50).leak();
        let row = |at| variable(at, Type::VisibleString(50)).default(DefaultValue::Text(text));
        (0..255).map(row).collect::<Vec<_>>()
    };
    let letters = ["a", "b", "c", "d", "e", "f"].map(texts);
    let mut all = letters.each_ref().map(Vec::as_slice).to_vec();
    let message = "2000h:0: the default values of the tables take more than 65536 bytes";
    assert_eq!(table_error(&all).as_deref(), Some(message));
    all[5] = all[0];
    assert_eq!(table_error(&all), None, "63750 bytes, and the last text again");
}

#[test]
fn too_many_dictionaries_do_not_compile() {
    let row: &[Object] = &[variable(0, Type::Unsigned8)];
    assert_eq!(table_error(&[row; 64]), None);
    let message = "more than 64 dictionaries are compiled together";
    assert_eq!(table_error(&[row; 65]).as_deref(), Some(message));
}

#[test]
fn rows_without_remote_frames_stay_without_them() {
    let once = objects::without_remote(objects::tpdo(1, &[INPUT]));
    assert_eq!(once[1].default, DefaultValue::NodeId(0x4000_0180));
    assert_eq!(objects::without_remote(once)[1].default, once[1].default);
    let off = objects::without_remote(objects::tpdo(5, &[]));
    assert_eq!(off[1].default, DefaultValue::Integer(0xC000_0000));
    assert_eq!(objects::without_remote(off)[1].default, off[1].default);
}

/// The device itself reads and writes these entries.
#[test]
fn an_entry_of_the_device_has_the_size_of_cia_301() {
    let error_behaviour = objects::error_behaviour(0)[1];
    for (row, kind, name) in [
        (objects::device_type(0), Type::Unsigned8, "1000h:0"),
        (objects::error_register(), Type::Unsigned32, "1001h:0"),
        (objects::identity(0, 1, 1)[1], Type::Unsigned8, "1018h:1"),
        (error_behaviour, Type::Unsigned16, "1029h:1"),
    ] {
        let wrong = changed(row, |row| row.kind = kind);
        let highest = Object::highest(row.index, 1, "");
        let rows = if row.sub == 0 { vec![wrong] } else { vec![highest, wrong] };
        assert_error(&[&rows], &format!("{name}: the entry of CiA 301 has a type of another size"));
    }
}

#[test]
fn the_highest_sub_index_is_that_of_the_last_row() {
    let entry = |sub| Object::new(0x2000, sub, "", Type::Unsigned8, Access::ReadWrite);
    let message = "2000h:0: sub-index 0 is not the highest sub-index of the object";
    assert_error(&[&[Object::highest(0x2000, 1, ""), entry(1), entry(2)]], message);
    assert_error(&[&[Object::highest(0x2000, 7, ""), entry(1)]], message);
    assert_eq!(compile_error(&[&[Object::highest(0x2000, 5, ""), entry(1), entry(5)]]), None, "with a gap");
    assert_eq!(compile_error(&[&[Object::highest(0x2000, 7, "")]]), None, "a single constant");
    assert_eq!(compile_error(&[&[Object::highest(0x2000, 0, ""), entry(1)]]), None, "set by the application");
}

#[test]
fn a_guard_time_has_a_life_time_factor() {
    let [time, factor] = objects::node_guarding();
    assert_error(&[&[time]], "100Ch:0: node guarding needs 100Ch and 100Dh");
    assert_error(&[&[factor]], "100Dh:0: node guarding needs 100Ch and 100Dh");
}

#[test]
fn a_table_without_rows_does_not_compile() {
    assert_eq!(message_of(|| check(&[])).as_deref(), Some("the table has no rows"));
}
