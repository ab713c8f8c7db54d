//! The catalogue of pre-defined lift PDOs compared with its table, in both directions. The table lists each of the 290
//! PDOs of CiA 417-3-1 in the corrected reading.

use std::collections::BTreeSet;

use profiles::lift::catalogue::{
    CobId, Content, Definition, Object, PDOS, Pdo, by_cob_id, by_number, name_of,
};

const TABLE: &str = include_str!("../../tables/lift417.csv");

/// One row: direction, number, communication and mapping index, identifier rule, type, times, objects.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Row {
    direction: String,
    number: u16,
    communication: u16,
    mapping: u16,
    cob_id: String,
    objects: String,
}

fn hex(text: &str) -> u16 {
    u16::from_str_radix(text.trim_start_matches("0x"), 16).unwrap()
}

fn table() -> BTreeSet<Row> {
    TABLE.lines().skip(1).map(row).collect()
}

fn row(line: &str) -> Row {
    let cells: Vec<&str> = line.split(',').collect();
    assert_eq!(&cells[5..8], ["0xFF", "0", "0"], "every pre-defined PDO has type FFh and no times: {line}");
    Row {
        direction: cells[0].into(),
        number: cells[1].parse().unwrap(),
        communication: hex(cells[2]),
        mapping: hex(cells[3]),
        cob_id: cells[4].into(),
        objects: cells[8].into(),
    }
}

fn objects(content: Content, seen_by: impl Fn(Object) -> Object) -> String {
    match content {
        Content::Multiplexed => "multiplexed".into(),
        Content::Objects(objects) => {
            let text =
                |object: Object| format!("{:04X}:{:02X}:{:02X}", object.index, object.sub, object.bits);
            objects.iter().map(|object| text(seen_by(*object))).collect::<Vec<_>>().join(";")
        }
    }
}

fn produced(pdo: &Pdo) -> Row {
    let cob_id = match pdo.cob_id {
        CobId::Fixed(id) => format!("{id:#X}"),
        CobId::PlusNode(base) => format!("{base:#X}+node-id"),
    };
    Row {
        direction: "TPDO".into(),
        number: pdo.number,
        communication: pdo.tpdo_index(),
        mapping: pdo.tpdo_index() + 0x200,
        cob_id,
        objects: objects(pdo.content, |object| object),
    }
}

fn consumed(pdo: &Pdo, producer: u8) -> Row {
    let communication = pdo.rpdo_index(producer).unwrap();
    Row {
        direction: "RPDO".into(),
        number: communication - 0x1400 + 1,
        communication,
        mapping: communication + 0x200,
        cob_id: format!("{:#X}", pdo.can_id(producer)),
        objects: objects(pdo.content, Object::consumed),
    }
}

fn catalogue() -> BTreeSet<Row> {
    let mut rows: BTreeSet<Row> = PDOS.iter().map(produced).collect();
    for pdo in PDOS {
        let producers = match pdo.cob_id {
            CobId::Fixed(_) => 1..=1,
            CobId::PlusNode(_) => 1..=127,
        };
        rows.extend(producers.map(|producer| consumed(pdo, producer)));
    }
    rows
}

#[test]
fn every_row_is_in_the_catalogue_and_nothing_else_is() {
    let (table, catalogue) = (table(), catalogue());
    assert_eq!(table.len(), 290);
    assert_eq!(table.difference(&catalogue).collect::<Vec<_>>(), Vec::<&Row>::new(), "only in the table");
    assert_eq!(catalogue.difference(&table).collect::<Vec<_>>(), Vec::<&Row>::new(), "only in the catalogue");
}

#[test]
fn every_identifier_of_the_table_is_found_with_its_producer() {
    for row in table().iter().filter(|row| row.direction == "RPDO") {
        let Definition { pdo, producer } = by_cob_id(hex(&row.cob_id).into()).unwrap();
        let index = pdo.rpdo_index(producer.unwrap_or(1));
        assert_eq!(index, Some(row.communication), "{}", row.cob_id);
    }
}

#[test]
fn other_identifiers_are_not_claimed() {
    for id in
        [0x000, 0x080, 0x17F, 0x184, 0x187, 0x18B, 0x190, 0x204, 0x208, 0x480, 0x500, 0x580, 0x601, 0x701_u32]
    {
        assert_eq!(by_cob_id(id), None, "{id:#X}");
    }
    assert_eq!(by_cob_id(0x2000_0180), None, "an extended frame");
    assert!(by_cob_id(0xC000_0180).is_some(), "flags do not matter");
}

#[test]
fn the_fields_of_a_frame_are_read_by_name() {
    let command = by_cob_id(0x182).unwrap();
    assert_eq!((command.pdo.name, command.producer), ("car drive, velocity command", None));
    let data = [0x0F, 0x00, 0x02, 0x00, 0x18, 0xFC, 0xFF, 0xFF];
    let fields: Vec<_> = command.fields().map(|field| (field.object.name, field.value(&data))).collect();
    let expected = [
        ("controlword", Some(0x0F)),
        ("mode of operation", Some(2)),
        ("reserved", Some(0)),
        ("target velocity", Some(0xFFFF_FC18)),
    ];
    assert_eq!(fields, expected);
    assert_eq!(command.fields().last().unwrap().value(&data[..7]), None, "too short");

    let input = by_cob_id(0x480 + 33).unwrap();
    assert_eq!((input.pdo.number, input.producer), (130, Some(33)));
    assert_eq!(input.fields().next().unwrap().value(&[1, 2, 3, 4, 5, 6]), Some(0x0605_0403_0201));
    assert_eq!(by_cob_id(0x521).unwrap().fields().count(), 0, "a multiplexed PDO names its object itself");
}

#[test]
fn every_definition_and_every_object_has_a_name_and_no_two_have_the_same() {
    let names: BTreeSet<_> = PDOS.iter().map(|pdo| pdo.name).collect();
    assert_eq!((names.len(), names.contains("")), (19, false));
    let mut objects = BTreeSet::new();
    for Object { index, sub, name, .. } in PDOS.iter().flat_map(|pdo| match pdo.content {
        Content::Objects(objects) => objects,
        Content::Multiplexed => &[],
    }) {
        assert_eq!(name_of(*index, *sub), Some(*name));
        objects.insert((*index, *sub, *name));
    }
    let names: BTreeSet<_> = objects.iter().map(|(.., name)| name).collect();
    assert_eq!((names.len(), names.contains(&"")), (objects.len(), false));
    assert_eq!(name_of(0x6383, 5), None);
}

#[test]
fn a_number_is_found_and_the_gap_is_none() {
    for number in 0..=512 {
        let expected = PDOS.iter().find(|pdo| pdo.number == number);
        assert_eq!(by_number(number), expected, "{number}");
    }
    assert_eq!(by_number(266), None, "the profile leaves it out");
}

#[test]
fn no_pdo_is_longer_than_a_frame() {
    for pdo in PDOS {
        if let Content::Objects(objects) = pdo.content {
            assert!(objects.iter().map(|object| u32::from(object.bits)).sum::<u32>() <= 64, "{}", pdo.name);
        }
    }
}

#[test]
fn a_producer_that_is_no_node_has_no_rpdo() {
    let virtual_input = PDOS.iter().find(|pdo| pdo.number == 130).unwrap();
    assert_eq!(virtual_input.rpdo_index(0), None);
    assert_eq!(virtual_input.rpdo_index(128), None);
}
