//! The error field of an EMCY that the application sets at run time.

use canopen::dictionary::{Dictionary, Object};
use canopen::sdo::Multiplexer;
use canopen::{Application, Condition, Device, Frame, Instant, NodeId, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::error_field::<5>(),
    objects::emergency(),
    objects::identity(0, 1, 1),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// An overload of a channel: the error field has the channel and its value.
struct Channels {
    channel: u8,
    value: u16,
}

impl Application for Channels {
    const CONDITIONS: &'static [Condition] = &[
        Condition::new(0x2310),
        Condition::new(0x5000),
        Condition { register: 0b1001, ..Condition::new(0x4000) },
    ];
    const LISTS_DETAIL: bool = true;

    fn fault_detail(&self, number: u8) -> Option<[u8; 5]> {
        let [low, high] = self.value.to_le_bytes();
        (number == 0).then_some([self.channel, 7, low, high, 0])
    }
}

type Node = canopen::device!(Channels, ROWS);

/// The data of the EMCYs that are sent until this instant.
fn emcys(node: &mut Node, now: Instant) -> Vec<Vec<u8>> {
    let mut sent = Sent::default();
    let _ = node.poll(now, &mut sent);
    let emcys = sent.0.iter().filter(|frame| frame.id() == 0x080 + u16::from(ID));
    emcys.map(|frame| frame.data().to_vec()).collect()
}

fn listed(node: &mut Node, sub: u8) -> Vec<u8> {
    let ask = |request: Frame| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(9), &mut sent);
        sent.0
    };
    exchange::read(ID, Multiplexer { index: 0x1003, sub }, ask).unwrap()
}

#[test]
fn an_emcy_has_the_error_field_of_the_moment_after_a_reset_too() {
    let mut node: Node = Device::new(&DICTIONARY, NodeId::new(ID), Channels { channel: 3, value: 0x1234 });
    let _ = node.start(Instant(0), &mut Sent::default());
    let _ = node.set_condition(1, true, Instant(1));
    let _ = node.set_condition(0, true, Instant(2));
    let expected = [vec![0x00, 0x50, 1, 0, 0, 0, 0, 0], vec![0x10, 0x23, 1, 3, 7, 0x34, 0x12, 0]];
    assert_eq!(emcys(&mut node, Instant(3)), expected);
    assert_eq!(listed(&mut node, 1), [0x10, 0x23, 3, 7]);
    assert_eq!(listed(&mut node, 2), [0x00, 0x50, 0, 0]);
    node.application_mut().value = 0x5678;
    let mut sent = Sent::default();
    let _ = node.start(Instant(4), &mut sent);
    let again: Vec<_> =
        sent.0.iter().filter(|frame| frame.id() == 0x085).map(|frame| frame.data()[3..7].to_vec()).collect();
    assert_eq!(again, [[3, 7, 0x78, 0x56], [0; 4]]);
}

#[test]
fn the_list_has_no_more_errors_than_1003h_has_entries() {
    let mut node: Node = Device::new(&DICTIONARY, NodeId::new(ID), Channels { channel: 3, value: 0x1234 });
    let _ = node.start(Instant(0), &mut Sent::default());
    for at in 1..=6 {
        let _ = node.set_condition(0, true, Instant(2 * at));
        let _ = emcys(&mut node, Instant(2 * at));
        let _ = node.set_condition(0, false, Instant(2 * at + 1));
        let _ = emcys(&mut node, Instant(2 * at + 1));
    }
    assert_eq!(listed(&mut node, 0), [4]);
    assert_eq!(listed(&mut node, 4), [0x10, 0x23, 3, 7]);
}

/// A condition with an error field of its own, and an application that gives none.
struct Fixed;

impl Application for Fixed {
    const CONDITIONS: &'static [Condition] =
        &[Condition { detail: [1, 2, 3, 4, 5], ..Condition::new(0x2310) }];
}

#[test]
fn an_emcy_has_the_error_field_of_its_condition_by_default() {
    let mut node: canopen::device!(Fixed, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Fixed);
    let mut sent = Sent::default();
    let _ = node.start(Instant(0), &mut sent);
    sent.0.clear();
    let _ = node.set_condition(0, true, Instant(1));
    let _ = node.poll(Instant(1), &mut sent);
    assert_eq!(sent.0, [Frame::new(0x085, &[0x10, 0x23, 1, 1, 2, 3, 4, 5]).unwrap()]);
}

#[test]
fn a_condition_may_name_the_generic_error() {
    let mut node: Node = Device::new(&DICTIONARY, NodeId::new(ID), Channels { channel: 0, value: 0 });
    let _ = node.start(Instant(0), &mut Sent::default());
    let _ = node.set_condition(2, true, Instant(1));
    assert_eq!(emcys(&mut node, Instant(2)), [[0x00, 0x40, 0b1001, 0, 0, 0, 0, 0]]);
    assert_eq!(DICTIONARY.field(0x1001, 0).u8(node.image()), 0b1001);
}
