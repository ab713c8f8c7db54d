//! One device type for two dictionaries, of which one has no EMCY (1014h) and no heartbeat.

use canopen::dictionary::{Dictionary, Object, Services, Sizes};
use canopen::{Application, Condition, Device, Instant, NodeId, objects};

use crate::types::Sent;

const ID: u8 = 5;
const FULL: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(1000)],
    objects::emergency(),
    objects::identity(0, 1, 1),
);
const BARE: &[Object] =
    canopen::rows!([objects::device_type(0), objects::error_register()], objects::identity(0, 1, 1));
static DICTIONARIES: [Dictionary; 2] = [canopen::dictionary!(FULL), canopen::dictionary!(BARE)];

struct OneCondition;

impl Application for OneCondition {
    const CONDITIONS: &'static [Condition] = &[Condition::new(0x5000)];
}

type Node = canopen::device!(OneCondition, room: Sizes::of(FULL));

/// The CAN-IDs of the frames that a node sends in 3 s, with a condition that becomes active.
fn ids(dictionary: &'static Dictionary) -> Vec<u16> {
    let mut sent = Sent::default();
    let mut node: Node = Device::new(dictionary, NodeId::new(ID), OneCondition);
    let _ = node.start(Instant(0), &mut sent);
    let _ = node.set_condition(0, true, Instant(10));
    for second in 0..3 {
        let _ = node.poll(Instant(second * 1_000_000 + 20), &mut sent);
    }
    sent.0.iter().map(canopen::Frame::id).collect()
}

#[test]
fn a_dictionary_without_emcy_and_heartbeat_sends_none_in_a_device_with_room_for_them() {
    assert_eq!(ids(&DICTIONARIES[0]), [0x705, 0x085, 0x705, 0x705]);
    assert_eq!(ids(&DICTIONARIES[1]), [0x705]);
}

#[test]
fn the_room_for_several_tables_is_the_largest_of_each_kind() {
    let rows = canopen::rows!([objects::device_type(0)], objects::heartbeat_consumer::<4>());
    let [full, watching] = [FULL, rows].map(Sizes::of);
    assert_eq!((full.watches, watching.watches), (0, 3));
    for all in [[FULL, rows], [rows, FULL]] {
        let room = Sizes::of_any(&all);
        assert!(full.fits(room) && watching.fits(room));
        assert_eq!((room.image, room.watches), (full.image.max(watching.image), 3));
    }
}

#[test]
fn a_device_has_room_for_a_table_that_is_larger_in_nothing() {
    let room = Sizes::of(FULL);
    assert!(room.fits(room) && Sizes::of(BARE).fits(room) && !room.fits(Sizes::of(BARE)));
    let larger = [
        Sizes { image: room.image + 1, ..room },
        Sizes { tpdos: room.tpdos + 1, ..room },
        Sizes { rpdos: room.rpdos + 1, ..room },
        Sizes { watches: room.watches + 1, ..room },
        Sizes { scanned: room.scanned + 1, ..room },
        Sizes { servers: room.servers + 1, ..room },
        Sizes { services: room.services.with(Services::SDO_CLIENT), ..room },
    ];
    for larger in larger {
        assert!(!larger.fits(room) && room.fits(larger), "{larger:?}");
    }
}
