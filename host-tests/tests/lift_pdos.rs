//! Each of the 290 PDOs of the table, produced and consumed by a device of the stack: at its number, with its CAN-ID, and
//! laid out as the table says.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Entry, Mapping, Object, Type};
use canopen::sdo::Abort;
use canopen::{Application, Device, Duration, Frame, Instant, NodeId};
use host_tests::bench::Queue;
use node::lift::pdos::{multiplexed_tpdo, rpdo, rpdo_mapping, tpdo, tpdo_mapping};
use profiles::lift::catalogue::by_cob_id;

const TABLE: &str = include_str!("../tables/lift417.csv");

/// Node-ID of the producer.
const ID: u8 = 33;
/// Rows of a dictionary: those of one PDO and its objects, and some that fill it up.
const ROWS: usize = 24;
const SIZE: usize = 128;

/// What the table says of a PDO.
struct Row {
    is_produced: bool,
    number: u16,
    communication: u16,
    mapping: u16,
    cob_id: u32,
    /// Index, sub-index and bits; none for a multiplexed PDO.
    objects: Vec<(u16, u8, u8)>,
}

impl Row {
    /// The objects; of a multiplexed PDO the one that it carries in these tests.
    fn carried(&self) -> Vec<(u16, u8, u8)> {
        if self.objects.is_empty() { vec![MULTIPLEXED] } else { self.objects.clone() }
    }

    /// The frame with this byte in all objects: a multiplexed one is for all nodes.
    fn frame(&self, value: u8) -> Frame {
        let (index, sub, _) = MULTIPLEXED;
        let [low, high] = index.to_le_bytes();
        let data = match &self.objects[..] {
            [] => vec![0x80, low, high, sub, value, value, 0, 0],
            objects => objects.iter().flat_map(|(.., bits)| vec![value; usize::from(bits / 8)]).collect(),
        };
        Frame::new(self.cob_id.try_into().unwrap(), &data).unwrap()
    }
}

/// What a multiplexed PDO carries in these tests.
const MULTIPLEXED: (u16, u8, u8) = (0x5001, 2, 16);

fn hex(text: &str) -> u32 {
    u32::from_str_radix(text.trim_start_matches("0x"), 16).unwrap()
}

fn object(text: &str) -> (u16, u8, u8) {
    let parts: Vec<u32> = text.split(':').map(hex).collect();
    (parts[0].try_into().unwrap(), parts[1].try_into().unwrap(), parts[2].try_into().unwrap())
}

fn row(line: &str) -> Row {
    let cells: Vec<&str> = line.split(',').collect();
    let cob_id = match cells[4].strip_suffix("+node-id") {
        Some(base) => hex(base) + u32::from(ID),
        None => hex(cells[4]),
    };
    let objects = if cells[8] == "multiplexed" { vec![] } else { cells[8].split(';').map(object).collect() };
    let [communication, mapping] = [2, 3].map(|cell: usize| hex(cells[cell]).try_into().unwrap());
    let number = cells[1].parse().unwrap();
    Row { is_produced: cells[0] == "TPDO", number, communication, mapping, cob_id, objects }
}

fn table() -> impl Iterator<Item = Row> {
    TABLE.lines().skip(1).map(row)
}

/// The rows that the stack makes of a number. The catalogue has the producer of an RPDO, the table has its number.
fn pdo(row: &Row) -> [Vec<Object>; 2] {
    let definition = by_cob_id(row.cob_id).unwrap();
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

fn rpdo_mappings(row: &Row, number: u16, producer: u8) -> Vec<Object> {
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

/// The objects of a PDO, and the dictionary of a device with nothing else.
fn device(row: &Row) -> (&'static Dictionary, Device<NoRules, SIZE>) {
    let (access, mapping) =
        if row.is_produced { (Access::ReadOnly, Mapping::Tpdo) } else { (Access::ReadWrite, Mapping::Rpdo) };
    let mapped = row.carried().into_iter().filter(|(index, ..)| *index >= 0x1000);
    let mut rows = pdo(row).concat();
    rows.extend(
        mapped.map(|(index, sub, bits)| Object::new(index, sub, "", kind(bits), access).mappable(mapping)),
    );
    let filled = (0..).map(|i| Object::new(0x7000 + i, 0, "", Type::Unsigned8, Access::ReadOnly));
    let missing = ROWS - rows.len();
    rows.extend(filled.take(missing));
    rows.sort_by_key(Object::key);
    let rows: [Object; ROWS] = rows.try_into().unwrap();
    let entries: &'static [Entry; ROWS] = Box::leak(Box::new(dictionary::compile(&rows)));
    let defaults: &'static [u8; SIZE] = Box::leak(Box::new(dictionary::default_image(&rows)));
    let dictionary: &'static Dictionary = Box::leak(Box::new(Dictionary::new(entries, defaults)));
    (dictionary, Device::new(dictionary, NodeId::new(ID), NoRules))
}

struct NoRules;

impl Application for NoRules {
    fn initialise(&mut self, _: &mut [u8]) {}

    fn write(&mut self, _: u8, _: &Entry, _: &[u8], _: &mut [u8]) -> Result<(), Abort> {
        Ok(())
    }
}

/// A device in Operational, with what it has sent on the way there.
fn operational(row: &Row) -> (&'static Dictionary, Device<NoRules, SIZE>, Vec<Frame>) {
    let (dictionary, mut device) = device(row);
    let mut out = Queue::default();
    device.start(NOW, &mut out);
    out.0.clear();
    device.on_process_frame(&Frame::new(0, &[1, ID]).unwrap(), NOW, &mut out);
    (dictionary, device, out.0)
}

const NOW: Instant = Instant(1_000_000);
const LATER: Instant = Instant(1_500_000);

#[test]
fn every_object_of_a_pdo_is_where_the_table_has_it() {
    let mut count = 0;
    for row in table() {
        let [communication, mapping] = pdo(&row);
        assert!(communication.iter().all(|own| own.index == row.communication), "{}", row.number);
        assert!(mapping.iter().all(|own| own.index == row.mapping));
        let expected: Vec<i64> = row
            .objects
            .iter()
            .map(|&(index, sub, bits)| i64::from(index) << 16 | i64::from(sub) << 8 | i64::from(bits))
            .collect();
        let (head, mapped) = mapping.split_first().unwrap();
        let number = if row.objects.is_empty() { 0xFF } else { expected.len().try_into().unwrap() };
        assert_eq!(head.default, DefaultValue::Integer(number));
        assert!(mapped.iter().map(|own| own.default).eq(expected.iter().map(|&e| DefaultValue::Integer(e))));
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
    for row in table().filter(|row| row.is_produced) {
        let (dictionary, mut device, first) = operational(&row);
        assert_eq!(first, [row.frame(0)], "{}", row.number);
        for (step, (index, sub, bits)) in (1..).zip(row.carried()) {
            dictionary.field(index, sub).set(device.image_mut(), &[7; 8][..usize::from(bits / 8)]);
            let mut out = Queue::default();
            let now = LATER + Duration::from_millis(step);
            device.changed(now, &mut out);
            device.changed(now, &mut out);
            assert_eq!(out.0.len(), 1, "{index:X}h of {}: one change, one frame", row.number);
            let is_last = usize::try_from(step).unwrap() == row.carried().len();
            assert_eq!(out.0[0] == row.frame(7), is_last);
        }
    }
}

#[test]
fn every_object_has_its_bytes_in_the_frame() {
    for row in table().filter(|row| row.is_produced && !row.objects.is_empty()) {
        let mut at = 0;
        for (index, sub, bits) in row.carried() {
            let (dictionary, mut device, _) = operational(&row);
            let len = usize::from(bits / 8);
            dictionary.field(index, sub).set(device.image_mut(), &[1, 2, 3, 4, 5, 6][..len]);
            let mut out = Queue::default();
            device.changed(LATER, &mut out);
            let mut expected = vec![0; row.frame(0).data().len()];
            expected[at..at + len].copy_from_slice(&[1, 2, 3, 4, 5, 6][..len]);
            assert_eq!(out.0[0].data(), expected, "{index:X}h of {}", row.number);
            at += len;
        }
    }
}

#[test]
fn every_rpdo_is_taken_at_once() {
    for row in table().filter(|row| !row.is_produced) {
        let (dictionary, mut device, first) = operational(&row);
        assert_eq!(first, []);
        assert!(device.process_ids().any(|id| u32::from(id.get()) == row.cob_id));
        device.on_process_frame(&row.frame(7), LATER, &mut Queue::default());
        for (index, sub, bits) in row.carried().into_iter().filter(|(index, ..)| *index >= 0x1000) {
            let value = dictionary.field(index, sub).get(device.image());
            assert_eq!(value, &[7; 8][..usize::from(bits / 8)], "{}", row.number);
        }
    }
}

/// What the node in personality lift has of them is what the table says.
#[test]
fn the_node_has_its_pdos_as_the_table_says() {
    let own = |index, sub| node::lift::PDOS.iter().find(|row| (row.index, row.sub) == (index, sub));
    let mut found = vec![];
    for row in table().filter(|row| own(row.communication, 1).is_some()) {
        for made in pdo(&row).concat() {
            let own = own(made.index, made.sub).unwrap();
            assert_eq!((own.kind, own.access, own.rule), (made.kind, made.access, made.rule));
            let [own, made] = [own.default, made.default].map(without_flags);
            assert_eq!(own, made, "{}", row.number);
        }
        found.push((row.is_produced, row.number));
    }
    let received = (2..=8).chain([257]).map(|number| (false, number));
    let sent = [2, 130, 258, 263, 264, 385, 386].map(|number| (true, number));
    assert!(found.into_iter().eq(sent.into_iter().chain(received)));
}

/// Units that are not there have their PDO off, bit 31.
fn without_flags(default: DefaultValue) -> DefaultValue {
    match default {
        DefaultValue::Integer(value) => DefaultValue::Integer(value & 0x7FFF_FFFF),
        other => other,
    }
}
