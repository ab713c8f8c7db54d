//! The store in normal use, and with a flash that fails.

use crate::model::{EMPTY, after, as_changes, noise, read_good, restore, set, start};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use storage::mock::MockFlash;
use storage::{Change, DeviceRecord, Error, GroupNumber, Loaded, MAX_VALUE, Memory, Pages, Store, View};

const PAGES: Pages = Pages::new(0, 512);

fn application(value: &[u8]) -> [Change<'_>; 1] {
    [Change::Set { group: GroupNumber::Three, version: 1, value }]
}

#[test]
fn a_value_is_read_with_its_version_and_an_empty_value_is_a_value() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let mut store = start(&mut flash, PAGES).unwrap();
    let value = [1, 2, 3, 4, 5];
    let group = GroupNumber::Two;
    store.save(&[Change::Set { group, version: 0xABCD, value: &value }]).unwrap();
    store.save(&application(&[])).unwrap();
    let mut buf = [0; 8];
    assert_eq!(store.load(group, &mut buf), Ok(Some(Loaded { version: 0xABCD, len: 5 })));
    assert_eq!(buf, [1, 2, 3, 4, 5, 0, 0, 0]);
    assert_eq!(store.load(group, &mut buf[..4]), Err(Error::BufferTooSmall));
    assert_eq!(store.load(GroupNumber::Three, &mut []), Ok(Some(Loaded { version: 1, len: 0 })));
    assert_eq!(store.load(GroupNumber::Four, &mut []), Ok(None));
}

#[test]
fn of_several_changes_to_one_group_the_last_counts() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let changes = vec![
        set(GroupNumber::One, 1, 4),
        set(GroupNumber::Three, 2, 9),
        restore(GroupNumber::One),
        set(GroupNumber::One, 3, 5),
    ];
    start(&mut flash, PAGES).unwrap().save(&as_changes(&changes)).unwrap();
    assert_eq!(read_good(&mut flash, PAGES), after(&EMPTY, &changes));
}

#[test]
fn a_device_record_of_another_layout_is_none() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let mut store = start(&mut flash, PAGES).unwrap();
    let record = DeviceRecord::new(7, 500, 1).unwrap();
    for (version, value, expected) in [
        (DeviceRecord::VERSION, record.encode().to_vec(), Some(record)),
        (DeviceRecord::VERSION + 1, record.encode().to_vec(), None),
        (DeviceRecord::VERSION, vec![7; 40], None),
    ] {
        store.save(&[Change::Set { group: GroupNumber::One, version, value: &value }]).unwrap();
        assert_eq!(store.device(), Ok(expected));
    }
}

#[test]
fn a_save_into_two_used_up_pages_is_refused_until_the_next_start_and_nothing_is_lost() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    for round in 0..20_u8 {
        let mut store = start(&mut flash, PAGES).unwrap();
        let mut saves = 0;
        while store.save(&application(&[round, saves])).is_ok() {
            saves += 1;
        }
        assert_eq!(store.save(&application(&[0])), Err(Error::Full));
        let mut buf = [0; 2];
        store.load(GroupNumber::Three, &mut buf).unwrap();
        assert_eq!(buf, [round, saves - 1]);
        assert!(saves >= 12, "at least a page's worth of saves after each start: {saves}");
    }
    let [first, second] = flash.erases() else { panic!("two pages") };
    assert!(first.abs_diff(*second) <= 1 && first + second <= 22, "wear is even: {first} and {second}");
}

#[test]
fn a_store_that_makes_room_while_it_runs_is_never_full() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let mut store = start(&mut flash, PAGES).unwrap();
    let before = store.erases();
    for number in 0..2_000_u32 {
        store.save(&application(&number.to_le_bytes())).unwrap();
        if store.needs_room() {
            store.make_room().unwrap();
            assert!(!store.needs_room());
        }
        let mut buf = [0; 4];
        store.load(GroupNumber::Three, &mut buf).unwrap();
        assert_eq!(buf, number.to_le_bytes());
    }
    let (erases, moves) = (store.erases() - before, store.moves());
    assert_eq!(erases, moves.into(), "each move costs one erase");
    assert_eq!(start(&mut flash, PAGES).unwrap().moves(), moves, "the count is kept in the pages");
    assert_eq!(flash.erases().iter().sum::<u32>(), erases + before);
}

#[test]
fn saves_left_succeed_without_an_erase_with_device_records_between_them() {
    let longest = [16, 60, 40, 20];
    let mut random = fastrand::Rng::with_seed(1);
    let mut flash = MockFlash::<2048, 4>::new(4096, 0);
    let pages = Pages::new(0, 2048);
    let mut store = start(&mut flash, pages).unwrap();
    let mut number = 0_u16;
    for _ in 0..200 {
        // Any history, then all saves that are left, of the greatest length.
        for _ in 0..random.u32(..12) {
            let group = *random.choice(GroupNumber::ALL.iter()).unwrap();
            let len = random.usize(..=longest[group as usize - 1]);
            number = number.wrapping_add(1);
            let _ = store.save(&as_changes(&vec![set(group, number, len)]));
        }
        for left in (0..store.saves_left(&longest)).rev() {
            number = number.wrapping_add(1);
            store.save(&as_changes(&vec![set(GroupNumber::One, number, 16)])).unwrap();
            number = number.wrapping_add(1);
            let all: Vec<_> = GroupNumber::ALL
                .iter()
                .map(|&group| set(group, number, longest[group as usize - 1]))
                .collect();
            store.save(&as_changes(&all)).unwrap();
            assert!(store.saves_left(&longest) >= left, "{left}");
        }
        store.make_room().unwrap();
        assert!(store.saves_left(&longest) > 0);
    }
}

/// A save reads only its own transaction again.
#[test]
fn after_every_save_the_store_agrees_with_a_start() {
    let mut random = fastrand::Rng::with_seed(5);
    let mut flash = MockFlash::<1024, 4>::new(2048, 0);
    let pages = Pages::new(0, 1024);
    let mut model = EMPTY;
    for round in 0..100_u16 {
        let mut store = start(&mut flash, pages).unwrap();
        for step in 0..random.u16(1..9) {
            let group = *random.choice(GroupNumber::ALL.iter()).unwrap();
            let change = if random.u8(..5) == 0 {
                restore(group)
            } else {
                set(group, round * 16 + step, random.usize(..60))
            };
            let changes = vec![change];
            if store.save(&as_changes(&changes)).is_ok() {
                model = after(&model, &changes);
            }
            for (group, expected) in GroupNumber::ALL.into_iter().zip(&model) {
                let mut buf = [0; 64];
                let loaded = store.load(group, &mut buf).unwrap();
                let found = loaded.map(|loaded| (loaded.version, buf[..loaded.len].to_vec()));
                assert_eq!(found, *expected, "{group:?}");
            }
        }
        let known = (store.saves_left(&[9; 4]), store.moves());
        let fresh = Store::prepare_within(View::open(&mut flash, pages).unwrap(), 0).unwrap();
        assert_eq!((fresh.saves_left(&[9; 4]), fresh.moves()), known);
    }
}

#[test]
fn a_start_without_erases_keeps_everything_and_room_is_made_later() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let mut store = start(&mut flash, PAGES).unwrap();
    let mut last = 0;
    while store.save(&application(&[last + 1])).is_ok() {
        last += 1;
    }
    let erased = flash.erases().to_vec();
    let view = View::open(&mut flash, PAGES).unwrap();
    let mut store = Store::prepare_within(view, 0).unwrap();
    assert_eq!((store.erases(), store.saves_left(&[16, 0, 1, 0])), (0, 0));
    assert_eq!(store.save(&application(&[0])), Err(Error::Full));
    let mut buf = [0; 1];
    store.load(GroupNumber::Three, &mut buf).unwrap();
    assert_eq!(buf, [last]);
    store.make_room().unwrap();
    store.save(&application(&[77])).unwrap();
    store.load(GroupNumber::Three, &mut buf).unwrap();
    assert_eq!((buf, store.erases()), ([77], 1));
    assert_eq!(flash.erases().iter().sum::<u32>(), erased.iter().sum::<u32>() + 1);
}

#[test]
fn a_set_too_large_for_a_page_is_refused_while_there_is_room() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let mut store = start(&mut flash, PAGES).unwrap();
    store.save(&application(&noise(1, 200))).unwrap();
    let value = noise(2, 241);
    let too_long = [Change::Set { group: GroupNumber::Two, version: 1, value: &value }];
    assert_eq!(store.save(&too_long), Err(Error::TooLong));
    let value = noise(2, 240);
    let fits = [Change::Set { group: GroupNumber::Two, version: 1, value: &value }];
    assert_eq!(store.save(&fits), Ok(()));
    assert_eq!(store.save(&application(&vec![0; MAX_VALUE + 1])), Err(Error::TooLong));
    assert_eq!(store.load(GroupNumber::Three, &mut [0; 200]), Ok(Some(Loaded { version: 1, len: 200 })));
}

#[test]
fn four_values_of_the_greatest_length_fit_the_pages_of_the_chip() {
    let pages = Pages::new(0, 16 * 1024);
    let mut flash = MockFlash::<16384, 4>::new(32 * 1024, 0);
    let changes: Vec<_> = GroupNumber::ALL.iter().map(|&group| set(group, 1, MAX_VALUE)).collect();
    for _ in 0..3 {
        start(&mut flash, pages).unwrap().save(&as_changes(&changes)).unwrap();
    }
    assert_eq!(read_good(&mut flash, pages), after(&EMPTY, &changes));
}

#[test]
fn pages_that_cannot_be_erased_one_by_one_are_refused() {
    for pages in [Pages::new(0, 384), Pages::new(128, 512), Pages::new(0, 1024)] {
        let mut flash = MockFlash::<256, 4>::new(1536, 0);
        let prepared = View::open(&mut flash, pages).and_then(Store::prepare);
        assert_eq!(prepared.err(), Some(Error::Geometry));
    }
}

#[test]
fn a_flash_that_programs_other_words_than_the_pages_say_is_refused() {
    let mut flash = MockFlash::<512, 8>::new(1024, 0);
    assert_eq!(View::open(&mut flash, PAGES).and_then(Store::prepare).err(), Some(Error::Geometry));
    for bytes in [0, 2, 12, 64] {
        assert_eq!(View::open(&mut flash, PAGES.with_words(bytes)).err(), Some(Error::Geometry));
    }
    for bytes in [8, 16, 32] {
        let pages = PAGES.with_words(bytes);
        start(&mut flash, pages).unwrap().save(&application(&[1, 2, 3])).unwrap();
        let mut buf = [0; 3];
        let loaded = start(&mut flash, pages).unwrap().load(GroupNumber::Three, &mut buf);
        assert_eq!((loaded, buf), (Ok(Some(Loaded { version: 1, len: 3 })), [1, 2, 3]));
        flash = MockFlash::new(1024, 0);
    }
}

#[test]
fn the_generation_of_the_pages_may_wrap() {
    // Pages so small that every save causes a move.
    let pages = Pages::new(0, 80);
    let mut flash = MockFlash::<80, 4>::new(160, 0);
    for count in 0..=66_000_u32 {
        let mut store = start(&mut flash, pages).unwrap();
        store.save(&application(&count.to_le_bytes())).unwrap();
        if count % 100 == 0 || count > 65_500 {
            let mut buf = [0; 4];
            View::open(&mut flash, pages).unwrap().load(GroupNumber::Three, &mut buf).unwrap();
            assert_eq!(u32::from_le_bytes(buf), count);
        }
    }
    assert!(flash.erases()[0] > 32_768);
}

/// A flash with one word in which a bit cannot be programmed, as in a worn-out cell.
struct Worn {
    flash: Memory<Vec<u8>>,
    at: u32,
}

impl ErrorType for Worn {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Worn {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Worn {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 512;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let stuck = u8::from(offset == self.at);
        let bytes: Vec<u8> = bytes.iter().map(|byte| byte | stuck).collect();
        self.flash.write(offset, &bytes)
    }
}

/// Stores with one such word each. `prepare` needs the clean mark only.
fn worn_stores() -> impl Iterator<Item = Store<Worn>> {
    (0..1024).step_by(4).filter_map(|at| {
        let worn = Worn { flash: Memory(vec![0xFF; 1024]), at };
        let store = View::open(worn, PAGES).and_then(Store::prepare);
        assert_eq!(store.is_err(), at % 512 == 0, "{at}");
        store.ok()
    })
}

#[test]
fn where_no_page_is_in_use_a_save_that_failed_succeeds_on_the_other_one() {
    let mut failed = 0;
    for mut store in worn_stores() {
        if store.save(&application(&[2])).is_err() {
            failed += 1;
            store.save(&application(&[4])).unwrap();
            let mut buf = [0; 1];
            store.load(GroupNumber::Three, &mut buf).unwrap();
            assert_eq!(buf, [4]);
        }
    }
    assert!(failed > 0);
}

#[test]
fn a_worn_out_word_fails_the_save_and_nothing_else() {
    for mut store in worn_stores() {
        let mut last = 0;
        for value in 1_u8..20 {
            let saved = store.save(&application(&[value * 2]));
            let mut buf = [0; 1];
            store.load(GroupNumber::Three, &mut buf).unwrap();
            match saved {
                Ok(()) => assert_eq!(buf, [value * 2]),
                Err(Error::Corrupt) => assert!(buf == [last] || buf == [value * 2], "old or new"),
                Err(Error::Full) => assert_eq!(buf, [last]),
                Err(error) => panic!("{error}"),
            }
            [last] = buf;
        }
    }
}

#[test]
fn an_unchanged_save_programs_nothing() {
    let mut flash = MockFlash::<512, 4>::new(1024, 0);
    let both = vec![set(GroupNumber::Two, 1, 7), restore(GroupNumber::Three), set(GroupNumber::One, 1, 4)];
    start(&mut flash, PAGES).unwrap().save(&as_changes(&both)).unwrap();
    let programmed = flash.programmed();
    start(&mut flash, PAGES).unwrap().save(&as_changes(&both)).unwrap();
    assert_eq!(flash.programmed(), programmed);

    let one = vec![set(GroupNumber::Two, 1, 7), set(GroupNumber::One, 1, 5)];
    start(&mut flash, PAGES).unwrap().save(&as_changes(&one)).unwrap();
    // Begin, contents; the record's head, two words of its value, its check; commit, closed.
    assert_eq!(flash.programmed() - programmed, 2 + 2 + 3 + 2, "only the group that differs");
    assert_eq!(read_good(&mut flash, PAGES), after(&after(&EMPTY, &both), &one));
}
