//! Tests of the LSS master with real nodes.

use canopen::client::lss as service;
use canopen::lss::{BitRate, Identity};
use canopen::{Duration, NodeId};
use nodectl::lss::{Error, Master, Selection};
use nodectl::{Network, object::at};

use crate::pressure::Pressure;
use crate::wire::{Wire, client};

fn identity(serial: u32) -> Identity {
    Identity {
        vendor: profiles::product::VENDOR_ID,
        product: 1,
        revision: profiles::product::REVISION,
        serial,
    }
}

fn master(network: &mut Network) -> Master<'_> {
    Master::new(network, Duration::from_millis(20))
}

fn unconfigured(serials: &[u32]) -> Wire<Vec<Pressure>> {
    Wire::new(serials.iter().map(|&serial| Pressure::new(None).with_serial(serial)).collect())
}

#[test]
fn fastscan_finds_one_after_the_other_and_gives_them_node_ids() {
    let serials = [0xFFFF_FFFF, 0x1234_5678, 0x1234_5679, 0];
    let mut network = unconfigured(&serials).network();
    let mut found = Vec::new();
    while let Some(identity) = master(&mut network).fastscan(|_| ()).unwrap() {
        found.push(identity.serial);
        let id = NodeId::new(10 + u8::try_from(found.len()).unwrap());
        let mut master = master(&mut network);
        assert_eq!(master.identity().unwrap(), identity);
        assert_eq!(master.node_id().unwrap(), None);
        master.set_node_id(id).unwrap();
        master.release().unwrap();
    }
    // Where both values of a bit occur, the scan takes the clear bit first.
    assert_eq!(found, [0, 0x1234_5678, 0x1234_5679, 0xFFFF_FFFF]);
    for (serial, id) in found.iter().zip(11..) {
        assert_eq!(client(&mut network, id).upload(at(0x1018, 4)).unwrap(), serial.to_le_bytes());
    }
}

#[test]
fn a_bus_without_unconfigured_nodes_has_nothing_to_find() {
    let mut network = Wire::new(vec![Pressure::new(5)]).network();
    assert_eq!(master(&mut network).fastscan(|_| ()).unwrap(), None);
}

#[test]
fn a_node_is_selected_by_its_identity() {
    let nodes = vec![Pressure::new(5).with_serial(1), Pressure::new(6).with_serial(2)];
    let mut network = Wire::new(nodes).network();
    network.pause(Duration::from_millis(5)).unwrap();
    let mut master = master(&mut network);
    master.select(Selection::One(identity(2))).unwrap();
    assert_eq!(master.node_id().unwrap(), NodeId::new(6));
    master.set_node_id(NodeId::new(7)).unwrap();
    master.store().unwrap();
    master.set_bit_rate(BitRate::from_kbit(500).unwrap()).unwrap();
    let error = master.select(Selection::One(identity(3))).unwrap_err();
    assert_eq!(error.to_string(), "LSS select: no answer");
}

#[test]
fn slaves_that_are_not_selected_do_not_answer() {
    let mut network = Wire::new(Pressure::new(5)).network();
    let mut master = master(&mut network);
    master.release().unwrap();
    assert!(matches!(master.node_id(), Err(Error::Service(service::Error::NoAnswer(_)))));
}
