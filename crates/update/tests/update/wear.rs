//! Erases that hostile programs on the bus cause, and the hours until the rated 10,000 erases of a sector are used up:
//! without the budget of clears, and with it. `cargo test -p update --test update wear -- --nocapture` prints them.

use update::mock::MockFlash;
use update::{Clears, Programs, Refusal, Status, Updater};

use crate::bench::{SECTORS, confirm, image_a, image_b, install, start, target, update};

/// Erases that a sector is rated for.
const RATED: f64 = 10_000.0;
/// Typical time of an erase of 128 KiB in seconds (STM32F446 data sheet).
const ERASE: f64 = 1.0;
/// Time of an update of the longest image at 1 Mbit/s after the clear, in seconds: docs/update.md.
const UPDATE: f64 = 2.25 + 3.7;

/// Erases of the sector that is erased most.
fn erases(flash: &MockFlash) -> u32 {
    let most = SECTORS.iter().scan(0, |at, size| {
        *at += size;
        Some(flash.erases(*at - size))
    });
    most.max().unwrap_or(0)
}

/// A node under attack: the bootloader that runs, and the budget that outlives its resets.
struct Node {
    updater: Updater<MockFlash>,
    clears: Clears,
}

impl Node {
    fn new(flash: MockFlash) -> Node {
        Node { updater: Updater::new(flash, target(), Status::GOOD), clears: Clears::default() }
    }

    fn reset(&mut self) {
        self.updater = Updater::new(self.updater.flash().clone(), target(), Status::GOOD);
    }

    /// 1F51h = 3.
    fn clear(&mut self) -> Result<(), Refusal> {
        self.updater.clear_within(&mut self.clears)?;
        while self.updater.poll() != update::Next::Nothing {}
        Ok(())
    }

    fn begin(&mut self) {
        if self.updater.begin(None).is_ok() {
            self.updater.receive(&[0]).unwrap();
        }
    }

    /// An image that the node accepts, confirmed. The number decides which one.
    fn replace(&mut self, round: u32) {
        let image = if round.is_multiple_of(2) { image_a() } else { image_b() };
        if self.clear().is_ok() {
            self.updater.begin(None).unwrap();
            self.updater.receive(&image.bytes()).unwrap();
            self.updater.finish().unwrap();
            while self.updater.poll() != update::Next::Nothing {}
            let flash = self.updater.flash();
            install(flash).unwrap();
            start(flash);
            confirm(flash);
        }
        self.reset();
    }
}

/// A hostile program on the bus: its name, the seconds of a round at least, and a round.
type Hostile = (&'static str, f64, fn(&mut Node, u32));

const HOSTILE: [Hostile; 4] = [
    ("1F51h = 3 again and again", ERASE, |node, _| {
        let _ = node.clear();
    }),
    ("1F51h = 3 and a byte of a download", ERASE, |node, _| {
        let _ = node.clear();
        node.begin();
    }),
    ("1F51h = 3 and a reset", ERASE, |node, _| {
        let _ = node.clear();
        node.reset();
    }),
    ("an accepted image again and again, each confirmed", ERASE + UPDATE, Node::replace),
];

/// The erases of the worst sector in this number of rounds, with these intervals of the budget after each.
fn wear(rounds: u32, intervals: u8, program: fn(&mut Node, u32)) -> u32 {
    let mut flash = MockFlash::new(&SECTORS, 1);
    update(&mut flash, &image_a().bytes()).unwrap();
    start(&mut flash);
    let before = erases(&flash);
    let mut node = Node::new(flash);
    for round in 0..rounds {
        program(&mut node, round + 1);
        node.clears = node.clears.refill(intervals);
    }
    erases(node.updater.flash()) - before
}

/// The figures of docs/safety.md.
#[test]
fn hostile_programs_wear_a_sector_no_faster_than_the_budget_allows() {
    let burst = u32::from(Clears::BURST);
    for (name, seconds, program) in HOSTILE {
        // An interval is much longer than a round, so a budget with one in each round limits nothing.
        let free = wear(20, 1, program);
        let most = wear(2 * burst, 0, program);
        if free <= 1 {
            println!("{name}: an erase in the first round only");
            continue;
        }
        assert!((19..=20).contains(&free), "{name}: {free} erases in 20 rounds");
        assert!((burst - 1..=burst).contains(&most), "{name}: {most} erases without an interval");
        let hours = |seconds: f64| seconds / 3600.0;
        let (before, now) = (RATED * seconds, (RATED - f64::from(burst)) * Clears::INTERVAL_SECONDS as f64);
        println!("{name}: {:.0} h without the budget, {:.0} h with it", hours(before), hours(now));
        assert!(hours(now) > 2900.0);
    }
}

#[test]
fn the_count_of_erases_is_that_of_the_flash() {
    let mut flash = MockFlash::new(&SECTORS, 1);
    for round in 0..20 {
        let image = if round % 2 == 0 { image_a() } else { image_b() };
        update(&mut flash, &image.bytes()).unwrap();
        start(&mut flash);
        confirm(&mut flash);
    }
    let counted = Programs::read(&mut flash, &target().layout, Clears::default()).erases;
    // Each area has two sectors. The first update keeps nothing.
    assert_eq!(counted, 3 * 20 - 1);
    assert_eq!(erases(&flash), 20);
}

#[test]
fn a_used_up_budget_refuses_a_clear_without_an_effect() {
    let mut flash = MockFlash::new(&SECTORS, 1);
    update(&mut flash, &image_a().bytes()).unwrap();
    let mut node = Node::new(flash);
    for _ in 0..Clears::BURST {
        node.clear().unwrap();
        node.reset();
    }
    let before = node.updater.flash().bytes();
    assert_eq!(node.clear(), Err(Refusal::Worn));
    assert_eq!(node.updater.status(), Status::refused(Refusal::Worn));
    assert_eq!(node.updater.flash().bytes(), before);
    node.clears = node.clears.refill(1);
    node.clear().unwrap();
    assert_eq!(node.clear(), Ok(()), "staging is erased: nothing to be paid");
}
