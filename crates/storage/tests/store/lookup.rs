//! The device record found by the bootloader's search, compared with the store.

use crate::model::{as_changes, noise, set, start};
use storage::mock::{MockFlash, Weak};
use storage::{Change, DeviceRecord, GroupNumber, Pages, device_record};

const PAGES: Pages = Pages::new(0, 512);
type Flash = MockFlash<512, 4>;

fn record(node_id: u8) -> DeviceRecord {
    DeviceRecord::new(node_id, 500, 1).unwrap()
}

fn save(flash: &mut Flash, node_id: u8) -> bool {
    let value = record(node_id).encode();
    let Ok(mut store) = start(flash, PAGES) else { return false };
    store
        .save(&[Change::Set { group: GroupNumber::One, version: DeviceRecord::VERSION, value: &value }])
        .is_ok()
}

#[test]
fn there_is_none_where_none_was_saved() {
    let mut flash = Flash::new(1024, 0);
    assert_eq!(device_record(&mut flash, PAGES), None);
    start(&mut flash, PAGES).unwrap().save(&as_changes(&vec![set(GroupNumber::Three, 1, 8)])).unwrap();
    assert_eq!(device_record(&mut flash, PAGES), None);
    assert_eq!(device_record(&mut flash, Pages::new(0, 4096)), None, "pages beyond the flash");
}

/// The record is found through many moves from page to page.
#[test]
fn it_is_the_one_that_was_saved_last() {
    let mut flash = Flash::new(1024, 0);
    for round in 1..=120 {
        assert!(save(&mut flash, round));
        let value = noise(u64::from(round), 40);
        let change = Change::Set { group: GroupNumber::Three, version: 1, value: &value };
        start(&mut flash, PAGES).unwrap().save(&[change]).unwrap();
        assert_eq!(device_record(&mut flash, PAGES), Some(record(round)));
    }
}

/// After a cut, the bootloader finds the same record as the store, once the store has started.
#[test]
fn after_a_cut_a_lookup_finds_the_old_or_the_new_value_as_the_store_does() {
    let mut cuts = 0;
    for before in 1..20 {
        for weak in Weak::ALL {
            for operation in 0.. {
                let mut flash = Flash::new(1024, u64::from(before));
                (1..=before).for_each(|id| assert!(save(&mut flash, id)));
                flash.cut_after(operation, weak);
                if save(&mut flash, 100) {
                    break;
                }
                flash.power_up();
                let found = device_record(&mut flash, PAGES);
                assert!(found == Some(record(before)) || found == Some(record(100)), "{found:?}");
                start(&mut flash, PAGES).unwrap();
                let stored = storage::View::open(&mut flash, PAGES).unwrap().device().unwrap();
                assert_eq!(device_record(&mut flash, PAGES), stored);
                cuts += 1;
            }
        }
    }
    println!("{cuts} cuts");
    assert!(cuts > 500);
}

/// A flipped bit costs the newest record at most; every record found was saved once.
#[test]
fn a_bit_that_flips_makes_no_record_that_was_never_saved() {
    let mut flash = Flash::new(1024, 0);
    (1..=9).for_each(|id| assert!(save(&mut flash, id)));
    let good = flash.bytes().clone();
    for bit in 0..good.len() * 8 {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let found = device_record(&mut storage::Memory(&bytes[..]), PAGES);
        let is_saved = found.is_none_or(|found| (1..=9).any(|id| found == record(id)));
        assert!(is_saved, "bit {bit}: {found:?}");
    }
}
