//! The most PDOs and heartbeats that CiA 301 allows: 512 PDOs in each direction, and 127 heartbeats.

use canopen::dictionary::{
    self, Access, DefaultValue, Dictionary, Mapping, Object, Services, Sizes, Tables, Type,
};
use canopen::{Duration, Fault, Frame, Instant, NodeId};

use crate::bench::{ID, Sent, download};

const PDOS: u16 = 512;
const WATCHES: u8 = 127;
const TPDO: u16 = 0x181;
const RPDO: u16 = 0x381;
const NOW: Instant = Instant(1_000_000);

const ROOM: Sizes = Sizes {
    image: 65_000,
    tpdos: 512,
    rpdos: 512,
    watches: 127,
    scanned: 0,
    servers: 0,
    services: Services::ALL,
};
type Node = canopen::device!(Recorder, room: ROOM);

/// Records the calls of the application.
#[derive(Default)]
struct Recorder {
    received: Vec<u16>,
    faults: Vec<(Fault, bool)>,
}

impl canopen::Application for Recorder {
    fn received(&mut self, rpdo: u16, _: &mut [u8]) {
        self.received.push(rpdo);
    }

    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.faults.push((fault, active));
    }
}

fn parameter(index: u16, sub: u8, kind: Type, value: i64) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite).value(value)
}

fn communication(index: u16, id: u16, transmission: i64) -> [Object; 4] {
    [
        Object::highest(index, 5, ""),
        parameter(index, 1, Type::Unsigned32, id.into()),
        parameter(index, 2, Type::Unsigned8, transmission),
        parameter(index, 5, Type::Unsigned16, 0),
    ]
}

fn mapping(index: u16, object: u16) -> [Object; 2] {
    [
        Object::new(index, 0, "", Type::Unsigned8, Access::ReadWrite).value(1).limits(0, 1),
        parameter(index, 1, Type::Unsigned32, i64::from(object) << 16 | 16),
    ]
}

/// PDO n maps the object 3000h + n; TPDOs are sent with every SYNC.
fn rows() -> Vec<Object> {
    let mut rows = vec![Object::highest(0x1016, WATCHES, "")];
    rows.extend((1..=WATCHES).map(|sub| parameter(0x1016, sub, Type::Unsigned32, 0)));
    rows.extend((0..PDOS).flat_map(|n| communication(0x1400 + n, RPDO + n, 255)));
    rows.extend((0..PDOS).flat_map(|n| mapping(0x1600 + n, 0x3000 + n)));
    rows.extend((0..PDOS).flat_map(|n| communication(0x1800 + n, TPDO + n, 1)));
    rows.extend((0..PDOS).flat_map(|n| mapping(0x1A00 + n, 0x3000 + n)));
    let object = |n| Object::new(0x3000 + n, 0, "", Type::Unsigned16, Access::ReadWrite);
    rows.extend((0..PDOS).map(|n| object(n).mappable(Mapping::Both)));
    assert!(rows.iter().all(|row| row.default != DefaultValue::None));
    rows
}

fn node() -> (&'static Dictionary, Box<Node>) {
    let rows = rows();
    let tables: &'static Tables<1, 64, 256, 64, 65_000> =
        Box::leak(Box::new(dictionary::compile(&dictionary::TableBuilder::of(&[rows.as_slice()]))));
    let [dictionary] = tables.dictionaries();
    let dictionary: &'static Dictionary = Box::leak(Box::new(dictionary));
    let mut node = Box::new(Node::new(dictionary, NodeId::new(ID), Recorder::default()));
    let mut sent = Sent::default();
    let _ = node.start(NOW, &mut sent);
    let _ = node.on_frame(&Frame::new(0, &[1, ID]).unwrap(), NOW, &mut sent);
    (dictionary, node)
}

/// The TPDOs after a SYNC, in the time that a bus of 1 Mbit/s needs for them and for a quarter of other frames.
fn answers(node: &mut Node) -> Vec<u16> {
    let mut sent = Sent::default();
    let mut next = node.on_frame(&Frame::new(0x80, &[]).unwrap(), NOW, &mut sent);
    let end = NOW + Duration::from_millis(100);
    while next.due() < end {
        next = node.poll(next.due(), &mut sent);
    }
    sent.0.iter().map(Frame::id).collect()
}

#[test]
fn all_512_tpdos_answer_one_sync() {
    let (_, mut node) = node();
    assert!(answers(&mut node).into_iter().eq((0..PDOS).map(|n| TPDO + n)));
}

#[test]
fn all_512_rpdos_have_their_own_object_and_their_own_number() {
    let (dictionary, mut node) = node();
    for n in 0..PDOS {
        let _ = node.on_frame(&Frame::new(RPDO + n, &n.to_le_bytes()).unwrap(), NOW, &mut Sent::default());
    }
    assert!(node.application().received.iter().copied().eq(1..=PDOS));
    for n in 0..PDOS {
        assert_eq!(dictionary.field(0x3000 + n, 0).u16(node.image()), n);
    }
}

#[test]
fn the_last_rpdo_has_faults_of_its_own() {
    let (_, mut node) = node();
    let mut sent = Sent::default();
    for data in [&[1][..], &[1, 2]] {
        let _ = node.on_frame(&Frame::new(RPDO + 511, data).unwrap(), NOW, &mut sent);
    }
    let short = Fault::RpdoTooShort(512);
    assert_eq!(node.application().faults, [(short, true), (short, false)]);
}

#[test]
fn one_of_many_is_switched_off_alone() {
    let (_, mut node) = node();
    let off = (u32::from(TPDO + 300) | 1 << 31).to_le_bytes();
    download(&mut node, (0x1800 + 300, 1), &off, NOW).unwrap();
    let expected = (0..PDOS).filter(|n| *n != 300).map(|n| TPDO + n);
    assert!(answers(&mut node).into_iter().eq(expected));
}

#[test]
fn all_127_nodes_are_watched() {
    let (_, mut node) = node();
    let mut sent = Sent::default();
    for watched in 1..=WATCHES {
        let entry = (u32::from(watched) << 16 | 100).to_le_bytes();
        download(&mut node, (0x1016, watched), &entry, NOW).unwrap();
        let _ = node.on_frame(&Frame::new(0x700 + u16::from(watched), &[5]).unwrap(), NOW, &mut sent);
    }
    let _ = node.poll(NOW + Duration::from_millis(101), &mut sent);
    let lost = (0..WATCHES).map(|number| (Fault::Heartbeat(number), true));
    assert!(node.application().faults.iter().copied().eq(lost));
}
