//! Flash content that no power cut explains: flipped bits, overwritten ranges, half erased and foreign pages. Every
//! value read must have been saved once, and must not claim to be newer than it is. Only the group with the damaged
//! record is affected.

use std::cell::RefCell;

use crate::model::{Changes, EMPTY, Model, after, as_changes, noise, read, read_good, restore, set, start};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use storage::mock::{MockFlash, PowerCut};
use storage::{Error, GroupNumber, Health, Loaded, Pages, Store, View};

const PAGES: Pages = Pages::new(0, 512);
type Flash = MockFlash<256>;

fn replay(saves: &mut dyn Iterator<Item = &Changes>) -> Model {
    saves.fold(EMPTY, |model, changes| after(&model, changes))
}

/// A device with a history of saves.
struct Device {
    flash: Flash,
    saves: Vec<Changes>,
}

impl Device {
    fn new(saves: Vec<Changes>) -> Device {
        let mut flash = Flash::new(1024, 1);
        let mut store = start(&mut flash, PAGES).unwrap();
        for changes in &saves {
            store.save(&as_changes(changes)).unwrap();
        }
        Device { flash, saves }
    }

    /// All saves are in one page, and the other page is clean.
    fn on_one_page() -> Device {
        use GroupNumber::{Four, One, Three, Two};
        Device::new(vec![
            vec![set(One, 1, 4), set(Two, 2, 20), set(Three, 3, 30), set(Four, 4, 6)],
            vec![set(Two, 5, 21)],
            vec![set(Three, 6, 31), restore(Four)],
            vec![set(One, 7, 4), set(Three, 8, 0)],
            vec![set(Three, 9, 33)],
        ])
    }

    /// The same device with enough further saves that the last ones are in the other page; the old page is not erased
    /// yet.
    fn just_moved() -> Device {
        let Device { mut saves, .. } = Device::on_one_page();
        saves.extend((10..17).map(|version| vec![set(GroupNumber::Three, version, 34)]));
        let device = Device::new(saves);
        assert!(device.flash.bytes()[512..].iter().any(|&byte| byte != 0xFF));
        device
    }

    fn newest(&self) -> Model {
        replay(&mut self.saves.iter())
    }

    /// Damages a copy and checks the values read from it.
    fn check(&self, honest: bool, damage: impl FnOnce(&mut Flash)) -> [Health; 4] {
        let mut flash = self.flash.clone();
        damage(&mut flash);
        self.check_read(&mut flash, honest).1
    }

    /// The same, with a check that a start repairs the store.
    fn check_and_mend(&self, honest: bool, damage: impl FnOnce(&mut Flash)) {
        let mut flash = self.flash.clone();
        damage(&mut flash);
        let (model, _) = self.check_read(&mut flash, honest);
        let changes = vec![set(GroupNumber::One, 77, 4)];
        start(&mut flash, PAGES).unwrap().save(&as_changes(&changes)).unwrap();
        assert_eq!(read_good(&mut flash, PAGES), after(&model, &changes), "mended");
    }

    fn check_read(&self, flash: &mut Flash, honest: bool) -> (Model, [Health; 4]) {
        let (model, health) = read(flash, PAGES);
        for (value, group) in model.iter().zip(GroupNumber::ALL) {
            let was_saved =
                self.saves.iter().flatten().any(|(saved, state)| *saved == group && state == value);
            assert!(value.is_none() || was_saved, "{value:?} was never saved");
        }
        for ((value, newest), health) in model.iter().zip(&self.newest()).zip(health) {
            match health {
                Health::Good => assert!(!honest || value == newest, "silently older"),
                Health::FellBack => {}
                Health::Lost => assert_eq!(*value, None),
            }
        }
        (model, health)
    }
}

#[test]
fn any_flipped_bit_of_either_page_is_noticed_or_harmless() {
    for device in [Device::on_one_page(), Device::just_moved()] {
        let mut doubtful = 0;
        for bit in 0..1024 * 8 {
            let health = device.check(true, |flash| flash.disturb(bit / 8, |byte| byte ^ 1 << (bit % 8)));
            doubtful += u32::from(health != [Health::Good; 4]);
        }
        for byte in 0..1024 {
            device.check_and_mend(true, |flash| flash.disturb(byte, |byte| byte ^ 0x10));
        }
        println!("of 8192 flipped bits {doubtful} made a group doubtful");
        assert!(doubtful > 500);
    }
}

#[test]
fn a_flipped_bit_in_the_newest_save_falls_back_to_the_one_before() {
    let device = Device::on_one_page();
    let end = device.flash.bytes()[..512].iter().rposition(|&byte| byte != 0xFF).unwrap();
    // The closing mark and the commit word are the last eight bytes.
    let mut flash = device.flash.clone();
    flash.disturb(end - 12, |byte| byte ^ 0x10);
    let (model, health) = read(&mut flash, PAGES);
    let before = replay(&mut device.saves[..device.saves.len() - 1].iter());
    assert_eq!((model, health), (before, [Health::Good, Health::Good, Health::FellBack, Health::Good]));
}

/// The place of a group's saved value in the page, found by its bytes.
fn place(flash: &Flash, (_, value): &(GroupNumber, crate::model::Value)) -> usize {
    let (_, value) = value.as_ref().unwrap();
    let bytes = flash.bytes();
    let mut found = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(value));
    found.next_back().expect("it is stored")
}

/// The expected health of all groups when a record of one group is damaged.
fn only(group: GroupNumber, health: Health) -> [Health; 4] {
    GroupNumber::ALL.map(|other| if other == group { health } else { Health::Good })
}

/// Every group and every kind of damage: the newest of several records, an older record, and the only record. The other
/// groups are saved together with the group, before it and after it.
#[test]
fn only_the_group_whose_record_is_damaged_is_affected() {
    for group in GroupNumber::ALL {
        let all = |version| GroupNumber::ALL.map(|group| set(group, version + group as u16, 12)).to_vec();
        for (saves, damaged, expected) in [
            (vec![all(10), vec![set(group, 20, 12)]], set(group, 20, 12), Health::FellBack),
            (vec![all(10), all(20)], set(group, 20 + group as u16, 12), Health::FellBack),
            (vec![all(10), vec![set(group, 20, 12)], all(30)], set(group, 20, 12), Health::Good),
            (vec![all(10), vec![set(group, 20, 12)]], set(group, 10 + group as u16, 12), Health::Good),
            (vec![all(10)], set(group, 10 + group as u16, 12), Health::Lost),
            (vec![vec![set(group, 1, 12)]], set(group, 1, 12), Health::Lost),
        ] {
            let device = Device::new(saves);
            let newest = device.newest();
            // The head of the record, its value and its check.
            for byte in 0..8 + 12 + 4 {
                for bit in 0..8 {
                    let mut flash = device.flash.clone();
                    let at = place(&flash, &damaged) - 8 + byte;
                    flash.disturb(at, |byte| byte ^ 1 << bit);
                    let (model, health) = read(&mut flash, PAGES);
                    assert_eq!(health, only(group, expected), "{group:?}, byte {byte}, bit {bit}");
                    for (other, (value, newest)) in
                        GroupNumber::ALL.into_iter().zip(model.iter().zip(&newest))
                    {
                        let is_newest = other != group || expected == Health::Good;
                        assert_eq!(
                            value == newest,
                            is_newest,
                            "{group:?}: {other:?}, byte {byte}, bit {bit}"
                        );
                    }
                }
            }
        }
    }
}

/// A damaged bit outside of the records (in marks, heads and commit words of the transactions) belongs to no group:
/// nothing is lost.
#[test]
fn a_flipped_bit_between_the_records_costs_nothing() {
    let device = Device::on_one_page();
    // The part before the records of the first transaction: clean, left, begin and contents.
    let before_the_records = 0..16;
    let end = device.flash.bytes()[..512].iter().rposition(|&byte| byte != 0xFF).unwrap();
    for byte in before_the_records.chain(end - 7..=end) {
        for bit in 0..8 {
            let health = device.check(true, |flash| flash.disturb(byte, |byte| byte ^ 1 << bit));
            assert_eq!(health, [Health::Good; 4], "byte {byte}, bit {bit}");
        }
    }
}

#[test]
fn a_damaged_first_save_of_the_only_page_loses_only_groups_without_a_later_save() {
    let device = Device::new(Device::on_one_page().saves[..2].to_vec());
    let health = device.check(true, |flash| flash.disturb(24, |byte| byte ^ 1));
    assert_eq!(health, [Health::Lost, Health::Good, Health::Good, Health::Good]);
}

#[test]
fn an_overwritten_stretch_is_noticed_or_harmless() {
    for device in [Device::on_one_page(), Device::just_moved()] {
        for seed in 0..2000 {
            let mut random = fastrand::Rng::with_seed(seed);
            let (at, len) = (random.usize(..1024), random.usize(..64));
            let fill = |index: usize| match seed % 3 {
                0 => noise(seed, 64)[index],
                1 => 0x00,
                _ => 0xFF,
            };
            // Cells that return to the erased value look like a save that was cut: the values are older but whole.
            device.check_and_mend(seed % 3 != 2, |flash| {
                (at..1024.min(at + len))
                    .enumerate()
                    .for_each(|(index, at)| flash.disturb(at, |_| fill(index)));
            });
        }
    }
}

#[test]
fn whatever_a_cut_erase_leaves_in_the_old_page_does_not_count() {
    let device = Device::just_moved();
    for seed in 0..500 {
        let mut flash = device.flash.clone();
        let mut random = fastrand::Rng::with_seed(seed);
        for at in 0..512 {
            let raised = if random.u64(..256) < seed % 256 { 0xFF } else { random.u8(..) };
            flash.disturb(at, |byte| byte | raised);
        }
        assert_eq!(read_good(&mut flash, PAGES), device.newest());
        start(&mut flash, PAGES).unwrap();
        assert_eq!(read_good(&mut flash, PAGES), device.newest());
    }
}

#[test]
fn foreign_pages_are_reported_and_replaced() {
    let contents = [
        (vec![0xFF; 1024], Health::Good),
        (vec![0x00; 1024], Health::Lost),
        (noise(3, 1024), Health::Lost),
        (b"PRM1 and then something else...\n".repeat(32), Health::Lost),
    ];
    for (content, expected) in contents {
        let mut flash = Flash::new(1024, 1);
        (0..1024).for_each(|at| flash.disturb(at, |_| content[at]));
        assert_eq!(read(&mut flash, PAGES), (EMPTY, [expected; 4]));
        let changes = vec![set(GroupNumber::One, 1, 4)];
        start(&mut flash, PAGES).unwrap().save(&as_changes(&changes)).unwrap();
        assert_eq!(read_good(&mut flash, PAGES), after(&EMPTY, &changes));
    }
}

#[test]
fn a_copy_of_a_transaction_inside_a_value_is_never_taken_for_one() {
    let first = vec![set(GroupNumber::One, 1, 4)];
    let page = Device::new(vec![first.clone()]).flash.bytes();
    let copy = vec![(GroupNumber::Three, Some((3, page[8..100].to_vec())))];
    let device = Device::new(vec![first, vec![set(GroupNumber::One, 2, 4)], copy]);
    let before = replay(&mut device.saves[..2].iter());
    // The save with the copy follows one that names every group and one with a single record. With its contents and the
    // head of its record damaged, the search for the next record enters the value.
    let copying = 8 + (8 + 16 + 3 * 12 + 8) + (8 + 16 + 8);
    for at in copying + 4..copying + 8 {
        let mut flash = device.flash.clone();
        flash.disturb(at, |byte| byte ^ 0x81);
        flash.disturb(copying + 8, |byte| byte ^ 0x81);
        assert_eq!(
            read(&mut flash, PAGES),
            (before.clone(), [Health::FellBack, Health::Lost, Health::Lost, Health::Lost])
        );
    }
}

#[test]
fn a_length_that_leads_out_of_the_page_is_damage() {
    let device = Device::on_one_page();
    let room = (512 - 8 - 5 * 4) / 4;
    for words in (room + 1..room + 10).chain([1000, u16::MAX]) {
        let mut flash = device.flash.clone();
        // The contents of the first transaction, with their complement.
        let head = [words.to_le_bytes(), (!words).to_le_bytes()].concat();
        (512 + 12..).zip(head).for_each(|(at, to)| flash.disturb(at, |_| to));
        assert_eq!(read(&mut flash, PAGES).0, device.newest());
    }
}

#[test]
fn damage_found_at_the_start_is_reported_after_its_repair() {
    let device = Device::new(Device::on_one_page().saves[..2].to_vec());
    let mut flash = device.flash.clone();
    flash.disturb(24, |byte| byte ^ 1);
    let store = start(&mut flash, PAGES).unwrap();
    let health = GroupNumber::ALL.map(|group| store.health(group));
    assert_eq!(health, [Health::Lost, Health::Good, Health::Good, Health::Good]);
    assert_eq!(read(&mut flash, PAGES).1, [Health::Good; 4], "the next start finds nothing");
}

#[test]
fn the_closing_mark_of_a_move_is_not_needed_after_the_old_page_is_marked_as_left() {
    let device = Device::just_moved();
    let bytes = device.flash.bytes();
    let words = usize::from(u16::from_le_bytes([bytes[512 + 12], bytes[512 + 13]]) & 0xFFF);
    let closing_mark = 512 + 8 + 8 + words * 4 + 4;
    assert_eq!(bytes[closing_mark..][..4], [0; 4]);
    let health = device.check(true, |flash| flash.disturb(closing_mark, |byte| byte ^ 1));
    assert_eq!(health, [Health::Good; 4]);
}

/// A flash that the test can access while a store uses it.
struct Shared<'a>(&'a RefCell<Flash>);

impl ErrorType for Shared<'_> {
    type Error = PowerCut;
}

impl ReadNorFlash for Shared<'_> {
    const READ_SIZE: usize = Flash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.borrow().capacity()
    }
}

impl NorFlash for Shared<'_> {
    const WRITE_SIZE: usize = Flash::WRITE_SIZE;
    const ERASE_SIZE: usize = Flash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        self.0.borrow_mut().erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().write(offset, bytes)
    }
}

#[test]
fn a_value_that_decays_while_the_store_runs_is_neither_read_nor_moved() {
    let flash = RefCell::new(Flash::new(1024, 1));
    let mut store = View::open(Shared(&flash), PAGES).and_then(Store::prepare).unwrap();
    store.save(&as_changes(&vec![set(GroupNumber::One, 1, 4), set(GroupNumber::Two, 2, 300)])).unwrap();
    flash.borrow_mut().disturb(100, |byte| byte ^ 4);
    assert_eq!(store.load(GroupNumber::Two, &mut [0; 300]), Err(Error::Corrupt));
    assert_eq!(store.load(GroupNumber::One, &mut [0; 4]), Ok(Some(Loaded { version: 1, len: 4 })));
    let before = flash.borrow().programmed();
    // The save does not fit the page any more, so it would move the decayed groups too.
    let moving = store.save(&as_changes(&vec![set(GroupNumber::Three, 3, 124)]));
    assert_eq!(moving, Err(Error::Corrupt));
    assert_eq!(flash.borrow().programmed(), before);
}
