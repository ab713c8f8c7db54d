//! Each of the 290 PDOs of the table, produced and consumed by a device of the stack: with its number and CAN-ID, and
//! with the layout of the table.

use canopen::dictionary::{
    self, Access, DefaultValue, Dictionary, Mapping, Object, Services, Sizes, Tables, Type,
};
use canopen::{Device, Duration, Frame, Instant, NodeId};
use host_tests::bench::Queue;
use host_tests::lift417::{Pdo, pdos};
use profiles::lift::catalogue::by_cob_id;
use profiles::lift::objects::pdos::{multiplexed_tpdo, rpdo, rpdo_mapping, tpdo, tpdo_mapping};

/// Node-ID of the producer.
const ID: u8 = 33;
/// Rows of a dictionary: those of one PDO and its objects, and filler rows.
const ROWS: usize = 24;
const SIZE: usize = 128;
/// A device with one PDO, or with one object in a multiplexed PDO.
type Node = canopen::device!((), room: Sizes { image: SIZE, tpdos: 1, rpdos: 1, watches: 0, scanned: 8, servers: 0, services: Services::ALL });

/// The objects of a PDO; for a multiplexed PDO the one that it carries in these tests.
fn carried(pdo: &Pdo) -> Vec<(u16, u8, u8)> {
    if pdo.objects.is_empty() { vec![MULTIPLEXED] } else { pdo.objects.clone() }
}

/// The frame with this byte in all objects; a multiplexed PDO is addressed to all nodes.
fn frame(pdo: &Pdo, value: u8) -> Frame {
    let (index, sub, _) = MULTIPLEXED;
    let [low, high] = index.to_le_bytes();
    let data = match &pdo.objects[..] {
        [] => vec![0x80, low, high, sub, value, value, 0, 0],
        objects => objects.iter().flat_map(|(.., bits)| vec![value; usize::from(bits / 8)]).collect(),
    };
    Frame::new(pdo.cob_id(ID).try_into().unwrap(), &data).unwrap()
}

/// The object that a multiplexed PDO carries in these tests.
const MULTIPLEXED: (u16, u8, u8) = (0x5001, 2, 16);

/// The dictionary rows that the stack makes for a PDO. The catalogue gives the producer of an RPDO, the table its
/// number.
fn made(row: &Pdo) -> [Vec<Object>; 2] {
    let definition = by_cob_id(row.cob_id(ID)).unwrap();
    let (number, producer) = (definition.pdo.number, definition.producer.unwrap_or(1));
    if !row.is_produced {
        return [rpdo(number, producer, "").to_vec(), rpdo_mappings(row, number, producer)];
    }
    let communication =
        if number == 2 { multiplexed_tpdo("").to_vec() } else { tpdo(number, "", true).to_vec() };
    let mapping = match row.objects.len() {
        0 => tpdo_mapping::<1>(number, "").to_vec(),
        1 => tpdo_mapping::<2>(number, "").to_vec(),
        2 => tpdo_mapping::<3>(number, "").to_vec(),
        _ => tpdo_mapping::<5>(number, "").to_vec(),
    };
    [communication, mapping]
}

fn rpdo_mappings(row: &Pdo, number: u16, producer: u8) -> Vec<Object> {
    match row.objects.len() {
        0 => rpdo_mapping::<1>(number, producer, "").to_vec(),
        1 => rpdo_mapping::<2>(number, producer, "").to_vec(),
        2 => rpdo_mapping::<3>(number, producer, "").to_vec(),
        _ => rpdo_mapping::<5>(number, producer, "").to_vec(),
    }
}

fn kind(bits: u8) -> Type {
    match bits {
        8 => Type::Unsigned8,
        16 => Type::Unsigned16,
        32 => Type::Unsigned32,
        48 => Type::Unsigned48,
        _ => panic!("{bits}"),
    }
}

/// The dictionary and the device with only this PDO and its objects.
fn device(row: &Pdo) -> (&'static Dictionary, Node) {
    let (access, mapping) =
        if row.is_produced { (Access::ReadOnly, Mapping::Tpdo) } else { (Access::ReadWrite, Mapping::Rpdo) };
    let mapped = carried(row).into_iter().filter(|(index, ..)| *index >= 0x1000);
    let mut rows = made(row).concat();
    rows.extend(
        mapped.map(|(index, sub, bits)| Object::new(index, sub, "", kind(bits), access).mappable(mapping)),
    );
    let filled = (0..).map(|i| Object::new(0x7000 + i, 0, "", Type::Unsigned8, Access::ReadOnly));
    let missing = ROWS - rows.len();
    rows.extend(filled.take(missing));
    rows.sort_by_key(Object::key);
    let rows: [Object; ROWS] = rows.try_into().unwrap();
    let tables: &'static Tables<1, ROWS, ROWS, ROWS, SIZE> =
        Box::leak(Box::new(dictionary::compile(&dictionary::TableBuilder::of(&[&rows]))));
    let [dictionary] = tables.dictionaries();
    let dictionary: &'static Dictionary = Box::leak(Box::new(dictionary));
    (dictionary, Device::new(dictionary, NodeId::new(ID), ()))
}

/// A device in Operational, with the frames that it has sent so far.
fn operational(row: &Pdo) -> (&'static Dictionary, Node, Vec<Frame>) {
    let (dictionary, mut device) = device(row);
    let mut out = Queue::default();
    let _ = device.start(NOW, &mut out);
    out.0.clear();
    let _ = device.on_process_frame(&Frame::new(0, &[1, ID]).unwrap(), NOW, &mut out);
    (dictionary, device, out.0)
}

const NOW: Instant = Instant(1_000_000);
const LATER: Instant = Instant(1_500_000);

#[test]
fn every_object_of_a_pdo_is_where_the_table_has_it() {
    let mut count = 0;
    for row in pdos() {
        let [communication, mapping] = made(&row);
        assert!(communication.iter().all(|own| own.index == row.communication), "{}", row.number);
        assert!(mapping.iter().all(|own| own.index == row.mapping));
        let (head, mapped) = mapping.split_first().unwrap();
        assert_eq!(head.default, DefaultValue::Integer(row.count().into()));
        let expected = row.entries().into_iter().map(|entry| DefaultValue::Integer(entry.into()));
        assert!(mapped.iter().map(|own| own.default).eq(expected));
        let of = |sub| communication.iter().find(|own| own.sub == sub).map(|own| own.default);
        assert_eq!(of(2), Some(DefaultValue::Integer(0xFF)));
        assert_eq!(of(5), Some(DefaultValue::Integer(0)));
        assert_eq!(of(3), row.is_produced.then_some(DefaultValue::Integer(0)));
        count += 1;
    }
    assert_eq!(count, 290);
}

#[test]
fn every_tpdo_is_sent_on_entering_operational_and_on_each_change() {
    for row in pdos().filter(|row| row.is_produced) {
        let (dictionary, mut device, first) = operational(&row);
        assert_eq!(first, [frame(&row, 0)], "{}", row.number);
        for (step, (index, sub, bits)) in (1..).zip(carried(&row)) {
            let mut out = Queue::default();
            let now = LATER + Duration::from_millis(step);
            let field = dictionary.field(index, sub);
            let mut change = || {
                device.publish(now, &mut out, |(), image| field.set(image, &[7; 8][..usize::from(bits / 8)]))
            };
            let _ = [change(), change()];
            assert_eq!(out.0.len(), 1, "{index:X}h of {}: one change, one frame", row.number);
            let is_last = usize::try_from(step).unwrap() == carried(&row).len();
            assert_eq!(out.0[0] == frame(&row, 7), is_last);
        }
    }
}

#[test]
fn every_object_has_its_bytes_in_the_frame() {
    for row in pdos().filter(|row| row.is_produced && !row.objects.is_empty()) {
        let mut at = 0;
        for (index, sub, bits) in carried(&row) {
            let (dictionary, mut device, _) = operational(&row);
            let len = usize::from(bits / 8);
            let field = dictionary.field(index, sub);
            let mut out = Queue::default();
            let set = |(): &mut (), image: &mut [u8]| field.set(image, &[1, 2, 3, 4, 5, 6][..len]);
            let _ = device.publish(LATER, &mut out, set);
            let mut expected = vec![0; frame(&row, 0).data().len()];
            expected[at..at + len].copy_from_slice(&[1, 2, 3, 4, 5, 6][..len]);
            assert_eq!(out.0[0].data(), expected, "{index:X}h of {}", row.number);
            at += len;
        }
    }
}

#[test]
fn every_rpdo_is_taken_at_once() {
    for row in pdos().filter(|row| !row.is_produced) {
        let (dictionary, mut device, first) = operational(&row);
        assert_eq!(first, []);
        assert!(device.process_ids().any(|id| u32::from(id.get()) == row.cob_id(ID)));
        let _ = device.on_process_frame(&frame(&row, 7), LATER, &mut Queue::default());
        for (index, sub, bits) in carried(&row).into_iter().filter(|(index, ..)| *index >= 0x1000) {
            let value = dictionary.field(index, sub).get(device.image());
            assert_eq!(value, &[7; 8][..usize::from(bits / 8)], "{}", row.number);
        }
    }
}
