//! The places of mapped values in the image: at its start, next to each other, and of parameters.

use canopen::dictionary::{Access, Dictionary, Field, Group, Mapping, Object, Type};
use canopen::{Frame, Instant, NodeId, objects};

use crate::bench::{ID, Nothing, Sent};

/// The first value of the image.
const STATUS: Object =
    Object::new(0x1002, 0, "", Type::Unsigned32, Access::ReadOnly).mappable(Mapping::Tpdo).value(0x0403_0201);
const INPUT: Object =
    Object::new(0x6000, 0, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo).value(5);
const PARAMETER: Object = Object::new(0x2000, 0, "", Type::Unsigned8, Access::ReadWrite)
    .mappable(Mapping::Rpdo)
    .stored(Group::Application);

const fn output(index: u16, kind: Type) -> Object {
    Object::new(index, 0, "", kind, Access::ReadWrite).mappable(Mapping::Rpdo)
}
const BYTES: [Object; 3] =
    [output(0x6200, Type::Unsigned8), output(0x6201, Type::Unsigned8), output(0x6202, Type::Unsigned8)];
const WORDS: [Object; 3] =
    [output(0x6203, Type::Unsigned32), output(0x6204, Type::Unsigned32), output(0x6205, Type::Unsigned32)];

const ROWS: &[Object] = canopen::rows!(
    [STATUS],
    objects::rpdo(1, &BYTES),
    objects::rpdo(2, &[WORDS[0], WORDS[1]]),
    objects::rpdo(3, &[PARAMETER]),
    objects::tpdo(1, &[STATUS, INPUT]),
    [PARAMETER, INPUT],
    BYTES,
    WORDS,
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const LAST: Field = DICTIONARY.field(0x6205, 0);

type Node = canopen::device!(Nothing, ROWS);

fn operational() -> (Node, Sent) {
    let (mut device, mut sent) = (Node::new(&DICTIONARY, NodeId::new(ID), Nothing), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    let _ = device.poll(Instant(2), &mut sent);
    (device, sent)
}

#[test]
fn a_tpdo_carries_the_first_value_of_the_image() {
    assert!(DICTIONARY.field(0x1002, 0).is_at(0));
    let (_, sent) = operational();
    let tpdo = sent.0.iter().find(|frame| frame.id() == 0x180 + u16::from(ID));
    assert_eq!(tpdo.map(Frame::data), Some(&[1, 2, 3, 4, 5][..]));
}

#[test]
fn an_rpdo_writes_all_its_neighbouring_values_and_no_other() {
    let (mut device, mut sent) = operational();
    let _ = device.publish(Instant(3), &mut sent, |_, image| LAST.set_u32(image, u32::MAX));
    for (base, data) in [(0x200, &[1, 2, 3][..]), (0x300, &[4, 0, 0, 0, 5, 0, 0, 0])] {
        let frame = Frame::new(base + u16::from(ID), data).unwrap();
        let _ = device.on_frame(&frame, Instant(4), &mut sent);
    }
    let image = device.image();
    assert_eq!([0x6200, 0x6201, 0x6202].map(|index| DICTIONARY.field(index, 0).u8(image)), [1, 2, 3]);
    assert_eq!([0x6203, 0x6204, 0x6205].map(|index| DICTIONARY.field(index, 0).u32(image)), [4, 5, u32::MAX]);
}

#[test]
fn the_caller_learns_of_a_parameter_that_an_rpdo_has_written() {
    let (mut device, mut sent) = operational();
    for (base, data, is_told) in [(0x200, &[1, 2, 3][..], false), (0x400, &[7], true)] {
        let frame = Frame::new(base + u16::from(ID), data).unwrap();
        let next = device.on_frame(&frame, Instant(4), &mut sent);
        assert_eq!(next.parameters, is_told, "{base:X}h");
    }
    assert_eq!(DICTIONARY.field(0x2000, 0).u8(device.image()), 7);
}
