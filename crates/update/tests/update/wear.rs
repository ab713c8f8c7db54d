//! Erases that hostile programs on the bus cause, and the hours until the rated 10,000 erases of a sector are used up.
//! `cargo test -p update --test update wear -- --nocapture` prints them.

use update::mock::MockFlash;
use update::{Status, Updater};

use crate::bench::{SECTORS, confirm, image_a, image_b, run, start, target, update};

/// Erases that a sector is rated for.
const RATED: f64 = 10_000.0;
/// Typical time of an erase of 128 KiB in seconds (STM32F446 data sheet).
const ERASE: f64 = 1.0;
/// Time of an update of the longest image at 1 Mbit/s after the clear, in seconds: docs/update.md.
const UPDATE: f64 = 2.25 + 3.7;

/// Erases of the sector that is erased most.
fn erases(flash: &MockFlash) -> f64 {
    let most = SECTORS.iter().scan(0, |at, size| {
        *at += size;
        Some(flash.erases(*at - size))
    });
    f64::from(most.max().unwrap_or(0))
}

/// Erases of the worst sector in each of `rounds`.
fn per_round(rounds: u32, mut round: impl FnMut(&mut MockFlash)) -> f64 {
    let mut flash = MockFlash::new(&SECTORS, 1);
    update(&mut flash, &image_a().bytes()).unwrap();
    start(&mut flash);
    let before = erases(&flash);
    (0..rounds).for_each(|_| round(&mut flash));
    (erases(&flash) - before) / f64::from(rounds)
}

#[test]
fn hostile_programs_erase_a_sector_once_a_round_at_most() {
    let mut kept = None;
    let clear = per_round(100, |flash| {
        let mut updater = kept.take().unwrap_or_else(|| Updater::new(flash.clone(), target(), Status::GOOD));
        updater.clear().unwrap();
        while updater.poll() != update::Next::Nothing {}
        *flash = updater.flash().clone();
        kept = Some(updater);
    });
    let mut kept = None;
    let begun = per_round(100, |flash| {
        let mut updater = kept.take().unwrap_or_else(|| Updater::new(flash.clone(), target(), Status::GOOD));
        updater.clear().unwrap();
        while updater.poll() != update::Next::Nothing {}
        updater.begin(None).unwrap();
        updater.receive(&[0]).unwrap();
        *flash = updater.flash().clone();
        kept = Some(updater);
    });
    let restarted = per_round(100, |flash| {
        let mut updater = Updater::new(&mut *flash, target(), Status::GOOD);
        updater.clear().unwrap();
        run(&mut updater).unwrap();
    });
    let mut round = 0;
    let whole = per_round(20, |flash| {
        round += 1;
        let image = if round % 2 == 0 { image_a() } else { image_b() };
        update(flash, &image.bytes()).unwrap();
        start(flash);
        confirm(flash);
    });
    for (name, erases, seconds) in [
        ("1F51h = 3 again and again", clear, ERASE),
        ("1F51h = 3 and a byte of a download", begun, ERASE),
        ("1F51h = 3 and a reset", restarted, ERASE),
        ("an accepted image again and again, each confirmed", whole, ERASE + UPDATE),
    ] {
        let hours = RATED * seconds / 3600.0;
        if erases > 0.5 {
            println!("{name}: an erase a round, {hours:.0} h");
        } else {
            println!("{name}: an erase in the first round only");
        }
    }
    assert!(clear <= 0.01, "{clear}: staging that is erased is not erased again");
    for erases in [begun, restarted, whole] {
        assert!((0.9..=1.0).contains(&erases), "{erases}");
    }
}
