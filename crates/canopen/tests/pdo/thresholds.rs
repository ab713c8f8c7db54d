//! Changes of mapped values that are too small for a TPDO of type 255.

use canopen::dictionary::{Access, Dictionary, Field, Mapping, Object, Type};
use canopen::{Application, Device, Frame, Instant, NodeId, objects};

use crate::bench::{ID, Sent};

const VALUE: Object =
    Object::new(0x6000, 0, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo).value(50);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::sync_consumer(),
    objects::identity(0, 1, 1),
    objects::tpdo(1, &[VALUE]),
    objects::with(objects::tpdo(2, &[VALUE]), 2, 1),
    objects::with(objects::tpdo(3, &[VALUE]), 2, 255),
    [VALUE],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const AT: Field = DICTIONARY.field(0x6000, 0);

/// A threshold of 10, and the value in each TPDO.
#[derive(Default)]
struct Threshold([u8; 3]);

impl Application for Threshold {
    const THRESHOLDS: bool = true;

    fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool {
        assert!(AT.is_at(place));
        AT.u8(image).abs_diff(self.0[tpdo]) < 10
    }

    fn sent(&mut self, tpdo: usize, image: &[u8]) {
        self.0[tpdo] = AT.u8(image);
    }
}

/// A device in Operational that shows these values, one each millisecond with a SYNC after it. Returns the values in each
/// TPDO.
fn sent(values: &[u8]) -> [Vec<u8>; 3] {
    let mut device: canopen::device!(Threshold, ROWS) =
        Device::new(&DICTIONARY, NodeId::new(ID), Threshold::default());
    let (mut out, mut now) = (Sent::default(), Instant(0));
    let _ = device.start(now, &mut out);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), now, &mut out);
    for value in values {
        now.0 += 1000;
        let _ = device.publish(now, &mut out, |_, image| AT.set_u8(image, *value));
        let _ = device.on_frame(&Frame::new(0x80, &[]).unwrap(), now, &mut out);
    }
    [0x180, 0x280, 0x380].map(|base| {
        let frames = out.0.iter().filter(|frame| frame.id() == base + u16::from(ID));
        frames.map(|frame| frame.data()[0]).collect()
    })
}

#[test]
fn a_tpdo_of_type_255_waits_for_the_difference_from_the_value_that_it_has_sent_itself() {
    let values = [55, 59, 60, 65, 69, 61, 51, 50];
    let [first, with_sync, third] = sent(&values);
    assert_eq!(first, [50, 60, 50]);
    assert_eq!(with_sync, values);
    assert_eq!(third, first);
}

/// The TPDOs of which the application learns.
#[derive(Default)]
struct Told(Vec<usize>);

impl Application for Told {
    const THRESHOLDS: bool = true;

    fn sent(&mut self, tpdo: usize, _: &[u8]) {
        self.0.push(tpdo);
    }
}

/// TPDO 2 is sent with each SYNC.
#[test]
fn the_application_learns_of_tpdos_that_send_on_changes_only() {
    let mut device: canopen::device!(Told, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Told::default());
    let mut out = Sent::default();
    let _ = device.start(Instant(0), &mut out);
    for (id, data) in [(0, &[1, ID][..]), (0x80, &[])] {
        let _ = device.on_frame(&Frame::new(id, data).unwrap(), Instant(1), &mut out);
    }
    let _ = device.poll(Instant(2), &mut out);
    for base in [0x180, 0x280, 0x380] {
        assert!(out.0.iter().any(|frame| frame.id() == base + u16::from(ID)), "{base:X}h");
    }
    assert_eq!(device.application().0, [0, 2]);
}

/// An application that leaves the thresholds and the events as they are.
struct Usual;

impl Application for Usual {
    const SENDS_EVENTS: bool = true;
    const THRESHOLDS: bool = true;

    fn sends_events(&self, tpdo: u16) -> bool {
        tpdo == 3
    }
}

#[test]
fn every_change_is_large_enough_and_there_is_no_event_by_default() {
    let mut device: canopen::device!(Usual, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Usual);
    let mut out = Sent::default();
    let _ = device.start(Instant(0), &mut out);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(0), &mut out);
    for value in 51..=53 {
        let now = Instant(1000 * u64::from(value));
        let _ = device.publish(now, &mut out, |_, image| AT.set_u8(image, value));
    }
    let sent = |base| out.0.iter().filter(|frame| frame.id() == base + u16::from(ID)).count();
    assert_eq!((sent(0x180), sent(0x380)), (4, 0), "TPDO 3 sends events");
}
