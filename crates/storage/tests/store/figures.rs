//! The figures in the documentation of the crate: `cargo test -p storage --test store -- --nocapture figures`

use crate::model::{Changes, as_changes, set, start};
use storage::mock::MockFlash;
use storage::{GroupNumber, MAX_VALUE, Pages};

const PAGE: usize = 16 * 1024;
const PAGES: Pages = Pages::new(0, 16 * 1024);
/// Guaranteed erase cycles of a sector (STM32F446 datasheet, flash memory endurance).
const ENDURANCE: usize = 10_000;
/// Programming time of a word in microseconds, typical and maximum (same datasheet, flash memory programming, x32).
const WORD_US: [f64; 2] = [16.0, 100.0];

fn blank() -> MockFlash<PAGE> {
    MockFlash::new(2 * PAGE, 0)
}

/// Groups and sizes of the values that are saved at once.
type Sizes = [(GroupNumber, usize)];

/// The changes of save `number`: every value differs from that of the save before.
fn changes(sizes: &Sizes, number: usize) -> Changes {
    sizes.iter().map(|&(group, len)| set(group, number as u16, len)).collect()
}

/// Number of saves that fit between two starts, if both pages are empty at the first.
fn saves_without_restart(sizes: &Sizes) -> usize {
    let mut flash = blank();
    let mut store = start(&mut flash, PAGES).unwrap();
    let mut saves = 0;
    while store.save(&as_changes(&changes(sizes, saves))).is_ok() {
        saves += 1;
    }
    saves
}

/// Words programmed by each of `count` saves, with a start before each.
fn words_of_saves(sizes: &Sizes, count: usize) -> Vec<u32> {
    let mut flash = blank();
    let words = (0..count).map(|number| {
        start(&mut flash, PAGES).unwrap();
        let before = flash.programmed();
        start(&mut flash, PAGES).unwrap().save(&as_changes(&changes(sizes, number))).unwrap();
        flash.programmed() - before
    });
    words.collect()
}

#[test]
fn saves_until_a_restart_and_until_worn_out() {
    let largest = GroupNumber::ALL.map(|group| (group, MAX_VALUE));
    let sets: [(&str, &Sizes, usize); 3] = [
        ("application group, 212 B", &[(GroupNumber::Three, 212)], 136),
        (
            "communication and application groups, 1405 B",
            &[(GroupNumber::Two, 1193), (GroupNumber::Three, 212)],
            22,
        ),
        ("all four groups at their most, 8192 B", &largest, 2),
    ];
    for (name, sizes, expected) in sets {
        let saves = saves_without_restart(sizes);
        let words = words_of_saves(sizes, saves + 1);
        let (one, dearest) = (words.iter().min().unwrap(), words.iter().max().unwrap());
        let ms = |words: &u32, us: f64| f64::from(*words) * us / 1000.0;
        println!("{name}:");
        println!("  {saves} saves without a restart, {} in the life of the flash", saves * ENDURANCE);
        println!(
            "  a save programs {one} words, {:.1} ms (at most {:.1} ms),",
            ms(one, WORD_US[0]),
            ms(one, WORD_US[1])
        );
        println!(
            "  one that moves {dearest} words, {:.1} ms (at most {:.1} ms)",
            ms(dearest, WORD_US[0]),
            ms(dearest, WORD_US[1])
        );
        assert_eq!(saves, expected, "the documentation states this");
    }
}
