//! Analysis of the frames on the bus.

use std::collections::BTreeMap;

use canbus::Stamped;
use canopen::pdo::Mpdo;
use host_tests::network::from_bus;
use profiles::lift::catalogue::{Content, by_cob_id};

use crate::table::{BARRIERS, CONTROLLER, DISPLAY, DOORS, DRIVE, LOAD, POSITION};

/// The last value of an object in a PDO with this identifier.
pub(crate) fn last(log: &[Stamped], id: u32, object: usize) -> u64 {
    let field = by_cob_id(id).unwrap().fields().nth(object).unwrap();
    let mut frames = log.iter().rev().filter_map(|stamped| from_bus(&stamped.frame));
    let frame = frames.find(|frame| u32::from(frame.id()) == id).unwrap();
    field.value(frame.data()).unwrap()
}

/// Checks that every frame is one of the catalogue, with the right length, or belongs to a CiA 301 service of an
/// existing device.
pub(crate) fn every_frame_is_known(log: &[Stamped]) {
    let mut counts = BTreeMap::<u16, usize>::new();
    for frame in log.iter().filter_map(|stamped| from_bus(&stamped.frame)) {
        *counts.entry(frame.id()).or_default() += 1;
        let Some(definition) = by_cob_id(frame.id().into()) else {
            assert!(is_service(frame.id()), "{:X}h", frame.id());
            continue;
        };
        match definition.pdo.content {
            Content::Objects(_) => {
                let bits: usize = definition.fields().map(|field| usize::from(field.object.bits)).sum();
                assert_eq!(frame.data().len() * 8, bits, "{}", definition.pdo.name);
            }
            Content::Multiplexed => {
                let mpdo = Mpdo::parse(frame.data().try_into().unwrap()).unwrap();
                let known: &[u16] = if definition.producer == Some(DISPLAY) {
                    &[0x5000]
                } else {
                    &[0x2303, 0x2313, 0x63B0, 0x63C0, 0x63C5]
                };
                assert!(known.contains(&mpdo.at.index), "{mpdo:?}");
            }
        }
    }
    let pdos: Vec<u16> = counts.keys().copied().filter(|id| by_cob_id((*id).into()).is_some()).collect();
    let expected =
        [0x182, 0x183, 0x188, 0x18C, 0x200, 0x201, 0x202, 0x205, 0x206, 0x400, 0x491, 0x507, 0x510, 0x511];
    assert_eq!(pdos, expected, "each device sends its own and nobody sends another's");
}

/// NMT commands, boot-up and heartbeats, and SDO responses after a time-out; no EMCY.
fn is_service(id: u16) -> bool {
    if id == 0 {
        return true;
    }
    let devices = [CONTROLLER, DRIVE, DISPLAY, POSITION, LOAD].into_iter().chain(DOORS).chain(BARRIERS);
    devices.map(u16::from).any(|device| [0x580 + device, 0x700 + device].contains(&id))
}
