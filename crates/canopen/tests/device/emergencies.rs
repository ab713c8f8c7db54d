//! The EMCY consumer (1028h).

use canopen::dictionary::{Dictionary, Object, Services};
use canopen::emcy::Message;
use canopen::nmt::Command;
use canopen::sdo::Multiplexer;
use canopen::{Action, Application, Device, Frame, Instant, NodeId, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::emcy_consumer::<128>(),
    objects::identity(0, 1, 1),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[derive(Default)]
struct Log(Vec<(u8, Message)>);

impl Application for Log {
    fn emergency(&mut self, node: NodeId, message: Message, _: &mut [u8]) {
        self.0.push((node.get(), message));
    }
}

type Node = canopen::device!(Log, ROWS);

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Log::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

fn consume(node: &mut Node, producer: u8, cob_id: u32) -> Result<(), u32> {
    exchange::write(ID, Multiplexer { index: 0x1028, sub: producer }, &cob_id.to_le_bytes(), |request| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(1), &mut sent);
        sent.0
    })
}

fn receive(node: &mut Node, id: u16, data: &[u8]) -> Vec<(u8, Message)> {
    let next = node.on_frame(&Frame::new(id, data).unwrap(), Instant(2), &mut Sent::default());
    assert!(next.services > Instant(2) || next.action.is_some() || next.services == Instant(0));
    core::mem::take(&mut node.application_mut().0)
}

const EMCY: [u8; 8] = [0x30, 0x81, 0x11, 1, 2, 3, 4, 5];
const MESSAGE: Message = Message { code: 0x8130, register: 0x11, detail: [1, 2, 3, 4, 5] };

#[test]
fn the_application_gets_the_emcys_of_the_nodes_in_1028h() {
    let mut node = node();
    assert_eq!(receive(&mut node, 0x089, &EMCY), [], "disabled by default");
    for (producer, cob_id) in [(9, 0x089), (127, 0x0FF), (1, 0x6DF)] {
        assert_eq!(consume(&mut node, producer, cob_id), Ok(()));
        assert!(node.service_ids().any(|id| u32::from(id.get()) == cob_id));
    }
    for (id, producer) in [(0x089, 9), (0x0FF, 127), (0x6DF, 1)] {
        assert_eq!(receive(&mut node, id, &EMCY), [(producer, MESSAGE)]);
    }
    assert_eq!(receive(&mut node, 0x08A, &EMCY), [], "another node");
    assert_eq!(receive(&mut node, 0x089, &EMCY[..7]), [], "an EMCY has eight bytes");
    let none = Message { code: 0, register: 0, detail: [0; 5] };
    assert_eq!(receive(&mut node, 0x089, &[0; 8]), [(9, none)], "no fault is left");
    assert_eq!(consume(&mut node, 9, 0x8000_0089), Ok(()));
    assert_eq!(receive(&mut node, 0x089, &EMCY), [], "disabled again");
}

#[test]
fn emcys_are_consumed_in_pre_operational_and_operational() {
    let mut node = node();
    consume(&mut node, 9, 0x089).unwrap();
    for (command, count) in [(Command::Start, 1), (Command::Stop, 0), (Command::EnterPreOperational, 1)] {
        let _ = node.nmt(command, Instant(1), &mut Sent::default());
        assert_eq!(receive(&mut node, 0x089, &EMCY).len(), count, "{command:?}");
    }
}

/// CiA 301, 7.5.2.32.
#[test]
fn the_cob_id_of_a_producer_follows_the_rules() {
    let mut node = node();
    for wrong in [0x0000_0000, 0x0000_0705, 0x4000_0089, 0x2000_0089, 0x0000_0601] {
        assert_eq!(consume(&mut node, 9, wrong), Err(0x0609_0030), "{wrong:X}");
    }
    assert_eq!(consume(&mut node, 9, 0x089), Ok(()));
    assert_eq!(consume(&mut node, 9, 0x08A), Err(0x0609_0030), "enabled");
    assert_eq!(consume(&mut node, 9, 0x8000_0089), Ok(()));
    assert_eq!(consume(&mut node, 9, 0x08A), Ok(()));
    assert_eq!(consume(&mut node, 128, 0x8000_0089), Err(0x0609_0011), "no node-ID");
}

#[test]
fn the_identifiers_change_with_a_producer() {
    let mut node = node();
    while node.poll(Instant(1), &mut Sent::default()).action.is_some() {}
    let write = Frame::new(0x605, &[0x23, 0x28, 0x10, 9, 0x89, 0, 0, 0]).unwrap();
    let next = node.on_frame(&write, Instant(2), &mut Sent::default());
    assert_eq!(next.action, Some(Action::Identifiers));
}

#[test]
fn rows_without_1028h_consume_nothing() {
    assert!(Services::of(ROWS).contains(Services::EMCY_CONSUMER));
    assert!(!Services::of(&objects::emergency()).contains(Services::EMCY_CONSUMER));
}
