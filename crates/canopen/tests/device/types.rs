//! Every data type of CiA 301, through SDO, PDO and the EDS.

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::sdo::Multiplexer;
use canopen::{Device, Frame, Instant, NodeId, QueueFull, Transmit, eds, objects};

use crate::exchange;

const ID: u8 = 5;

const fn row(sub: u8, kind: Type) -> Object {
    Object::new(0x2100, sub, "", kind, Access::ReadWrite).mappable(Mapping::Tpdo)
}

const WIDE: Object = row(7, Type::Real64).real64(-0.1);
const REAL: Object =
    Object::new(0x2100, 15, "", Type::Real32, Access::ReadWrite).real(0.0).mappable(Mapping::Rpdo);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::identity(0, 1, 1),
    objects::rpdo(1, &[REAL]),
    objects::tpdo(1, &[WIDE]),
    [
        Object::highest(0x2100, 15, ""),
        row(1, Type::Integer24).value(-2).limits(-3, 4),
        row(2, Type::Integer40).value(-2),
        row(3, Type::Integer48).value(-2),
        row(4, Type::Integer56).value(-2),
        row(5, Type::Integer64).value(i64::MIN),
        row(6, Type::Unsigned24).value(0xFF_FFFE),
        WIDE,
        row(8, Type::Unsigned40).value(0xFF_0000_0001),
        row(9, Type::Unsigned56).value(0xFF_0000_0000_0001),
        row(10, Type::TimeOfDay).value(0x1234 << 32 | 1),
        row(11, Type::TimeDifference).value(7),
        row(12, Type::OctetString(8)),
        Object::new(0x2100, 13, "", Type::OctetString(12), Access::ReadWrite),
        row(14, Type::Unsigned64).value(i64::MAX),
        REAL,
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[derive(Default)]
pub(crate) struct Sent(pub(crate) Vec<Frame>);

impl Transmit for Sent {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

type Node = canopen::device!((), ROWS);

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), ());
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

fn write(node: &mut Node, sub: u8, bytes: &[u8]) -> Result<(), u32> {
    exchange::write(ID, Multiplexer { index: 0x2100, sub }, bytes, |request| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(1), &mut sent);
        sent.0
    })
}

#[test]
fn every_type_has_its_size_its_default_and_its_code() {
    let node = node();
    let value = |sub| DICTIONARY.field(0x2100, sub).get(node.image()).to_vec();
    let expected: [(u8, &[u8], u16); 13] = [
        (1, &[0xFE, 0xFF, 0xFF], 0x10),
        (2, &[0xFE, 0xFF, 0xFF, 0xFF, 0xFF], 0x12),
        (3, &[0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF], 0x13),
        (4, &[0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF], 0x14),
        (5, &[0, 0, 0, 0, 0, 0, 0, 0x80], 0x15),
        (6, &[0xFE, 0xFF, 0xFF], 0x16),
        (7, &(-0.1_f64).to_le_bytes(), 0x11),
        (8, &[1, 0, 0, 0, 0xFF], 0x18),
        (9, &[1, 0, 0, 0, 0, 0, 0xFF], 0x1A),
        (10, &[1, 0, 0, 0, 0x34, 0x12], 0x0C),
        (11, &[7, 0, 0, 0, 0, 0], 0x0D),
        (12, &[0; 8], 0x0A),
        (13, &[0; 12], 0x0A),
    ];
    for (sub, bytes, code) in expected {
        assert_eq!(value(sub), bytes, "2100h:{sub}");
        let row = ROWS.iter().find(|row| (row.index, row.sub) == (0x2100, sub)).unwrap();
        assert_eq!(row.kind.code(), code, "2100h:{sub}");
    }
}

#[test]
fn a_client_writes_every_type_and_its_length_is_checked() {
    let mut node = node();
    for sub in 2..=14 {
        let size = DICTIONARY.field(0x2100, sub).get(node.image()).len();
        let bytes: Vec<u8> = (1..).take(size).collect();
        assert_eq!(write(&mut node, sub, &bytes), Ok(()), "2100h:{sub}");
        assert_eq!(DICTIONARY.field(0x2100, sub).get(node.image()), bytes);
        assert_eq!(write(&mut node, sub, &bytes[1..]), Err(0x0607_0013), "2100h:{sub}");
    }
    assert_eq!(write(&mut node, 1, &[4, 0, 0]), Ok(()));
    assert_eq!(write(&mut node, 1, &[5, 0, 0]), Err(0x0609_0031));
    assert_eq!(write(&mut node, 1, &[0xFC, 0xFF, 0xFF]), Err(0x0609_0032));
}

#[test]
fn a_real64_is_sent_by_pdo() {
    let (mut node, mut sent) = (node(), Sent::default());
    let _ = node.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    let field = DICTIONARY.field(0x2100, 7);
    let _ = node.publish(Instant(2), &mut sent, |(), image| field.set_f64(image, 1e300));
    assert_eq!(sent.0.last().map(Frame::data), Some(&1e300_f64.to_le_bytes()[..]));
}

#[test]
fn an_rpdo_leaves_out_nan_and_infinity_of_a_real32() {
    let mut node = node();
    let _ = node.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut Sent::default());
    for (value, kept) in [(1.5, 1.5), (f32::NAN, 1.5), (f32::INFINITY, 1.5), (-2.5_f32, -2.5_f32)] {
        let frame = Frame::new(0x205, &value.to_le_bytes()).unwrap();
        let _ = node.on_frame(&frame, Instant(2), &mut Sent::default());
        assert_eq!(DICTIONARY.field(0x2100, 15).load(node.image()), kept.to_le_bytes(), "{value}");
    }
}

#[test]
fn the_eds_has_the_value_of_a_real64_and_not_its_bits() {
    let mut text = String::new();
    eds::write(ROWS, &eds::DeviceInfo::new("", ""), &mut text).unwrap();
    assert!(text.contains("DataType=0x0011\r\nAccessType=rwr\r\nDefaultValue=-0.1\r\n"), "{text}");
}
