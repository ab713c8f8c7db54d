//! Power cuts at every flash operation of whole updates, and again in the recovery.

use crate::bench::{
    Image, SECTORS, chance, confirm, flash_of_words_with, flash_with, holds, image_a, image_b, install,
    is_thorough, stage, start, update,
};
use update::mock::{MockFlash, Weak};
use update::{Decision, Refusal, Stay};

/// The image that starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Runs {
    Old,
    New,
    Nothing,
}

/// Only one of this many operations is cut, unless the run is thorough.
const SAMPLE: u32 = 3;

/// Least number of cuts among `all`.
fn at_least(all: u32) -> u32 {
    if is_thorough() { all } else { all / SAMPLE }
}

/// A node before an update, and the update.
struct Case {
    before: MockFlash,
    /// The same node with the new image committed but not copied: cuts in the copy start here, to save time.
    committed: MockFlash,
    old: Option<Image>,
    new: Image,
}

impl Case {
    fn new(before: MockFlash, old: Option<Image>) -> Case {
        let (mut committed, new) = (before.clone(), image_b());
        stage(&mut committed, &new.bytes()).unwrap();
        Case { before, committed, old, new }
    }

    /// A node that runs A, installed by an update.
    fn from_a_to_b() -> Case {
        Case::new(flash_with(&image_a(), 1), Some(image_a()))
    }

    /// The same with a flash that programs words of eight bytes.
    fn from_a_to_b_in_words_of_eight() -> Case {
        Case::new(flash_of_words_with(&image_a(), 8, 1), Some(image_a()))
    }

    /// A node that was never programmed.
    fn from_nothing_to_b() -> Case {
        Case::new(MockFlash::new(&SECTORS, 1), None)
    }

    /// Number of flash operations of the whole update.
    fn operations(&self) -> u32 {
        let mut flash = self.committed.clone();
        install(&mut flash).unwrap();
        flash.operations() - self.before.operations()
    }

    /// The flash after a power cut in this operation of the update.
    fn cut(&self, operation: u32, weak: Weak) -> MockFlash {
        let commit = self.committed.operations() - self.before.operations();
        let mut flash = if operation < commit { self.before.clone() } else { self.committed.clone() };
        flash.cut_after(if operation < commit { operation } else { operation - commit }, weak);
        let outcome =
            if operation < commit { stage(&mut flash, &self.new.bytes()) } else { install(&mut flash) };
        assert!(outcome.is_err() && flash.is_down());
        flash.power_up();
        flash
    }

    /// Starts the node; the result must be one of the complete images, or none if there was none before.
    fn start(&self, flash: &mut MockFlash) -> Runs {
        match (start(flash), &self.old) {
            (Decision::Start(header), Some(old)) if header == old.header && holds(flash, old) => Runs::Old,
            (Decision::Start(header), _) if header == self.new.header && holds(flash, &self.new) => Runs::New,
            (Decision::Stay(Stay::NoProgram(Refusal::UnknownFormat)), None) => Runs::Nothing,
            (decision, _) => panic!("neither old nor new: {decision:?}"),
        }
    }

    /// Starts the node twice: the decision of one start is final.
    fn settle(&self, flash: &mut MockFlash) -> Runs {
        let runs = self.start(flash);
        flash.power_up();
        assert_eq!(self.start(flash), runs, "decided once");
        runs
    }

    /// Cuts everywhere, in each of the ways. Without `cargo xtask test --thorough` only at every third operation, and
    /// at all operations around the commit and the end.
    fn cut_everywhere(&self, ways: &[Weak], mut check: impl FnMut(MockFlash)) {
        let (commit, end) = (self.committed.operations() - self.before.operations(), self.operations());
        let decides = |at: u32| at.abs_diff(commit) < 6 || end - at < 6;
        for operation in (0..end).filter(|at| is_thorough() || at % SAMPLE == 0 || decides(*at)) {
            for weak in ways {
                check(self.cut(operation, *weak));
            }
        }
    }
}

/// Every cut of a case, and a second download after every seventh cut that did not leave the new image.
fn check_every_cut(case: &Case, ways: &[Weak]) -> [u32; 3] {
    let mut count = [0; 3];
    let mut again = 0;
    case.cut_everywhere(ways, |mut flash| {
        let runs = case.settle(&mut flash);
        count[runs as usize] += 1;
        again += u32::from(runs != Runs::New);
        if runs != Runs::New && again % 7 == 0 {
            update(&mut flash, &case.new.bytes()).unwrap();
            assert_eq!(case.settle(&mut flash), Runs::New);
        }
    });
    let [old, new, nothing] = count;
    let cuts = old + new + nothing;
    println!("{cuts} cuts: {old} left the old image, {new} the new one, {nothing} none where there was none");
    count
}

#[test]
fn after_a_cut_anywhere_the_old_or_the_new_image_starts() {
    let [old, new, nothing] = check_every_cut(&Case::from_a_to_b(), &Weak::ALL);
    assert!(old > at_least(500) && new > at_least(500) && nothing == 0);
}

#[test]
fn the_same_holds_for_a_flash_that_programs_words_of_eight_bytes() {
    let [old, new, nothing] = check_every_cut(&Case::from_a_to_b_in_words_of_eight(), &Weak::ALL);
    assert!(old > at_least(250) && new > at_least(250) && nothing == 0);
}

#[test]
fn after_a_cut_in_the_first_update_the_image_starts_or_the_node_waits_for_the_next() {
    let [old, new, nothing] = check_every_cut(&Case::from_nothing_to_b(), &[Weak::Random]);
    assert!(old == 0 && new > at_least(250) && nothing > at_least(250));
}

#[test]
fn a_second_cut_in_the_recovery_changes_nothing() {
    second_cuts(&Case::from_a_to_b(), 250);
}

#[test]
fn a_second_cut_in_the_recovery_of_words_of_eight_bytes_changes_nothing() {
    second_cuts(&Case::from_a_to_b_in_words_of_eight(), 125);
}

fn second_cuts(case: &Case, all: u32) {
    let mut cuts = 0_u32;
    case.cut_everywhere(&[Weak::Either], |first| {
        let mut flash = first.clone();
        let runs = case.start(&mut flash);
        let recovery = flash.operations() - first.operations();
        if recovery == 0 {
            return;
        }
        let mut flash = first;
        let operation = chance(cuts) % recovery;
        flash.cut_after(operation, Weak::ALL[cuts as usize % 4]);
        start(&mut flash);
        assert!(flash.is_down());
        flash.power_up();
        let again = case.settle(&mut flash);
        // An incomplete commit that was not revoked yet may still read well.
        assert!(again == runs || recovery <= 4, "{runs:?} became {again:?}");
        cuts += 1;
    });
    println!("{cuts} second cuts in the recovery");
    assert!(cuts > at_least(all));
}

#[test]
fn a_cut_in_the_update_that_follows_a_cut_loses_nothing() {
    let mut cuts = 0_u32;
    let case = Case::from_a_to_b();
    for seed in 0..50 {
        let mut flash = case.before.clone();
        for round in 0..4 {
            let mut whole = flash.clone();
            update(&mut whole, &case.new.bytes()).unwrap();
            let at = chance(seed * 4 + round) % (whole.operations() - flash.operations());
            flash.cut_after(at, Weak::ALL[at as usize % 4]);
            assert!(update(&mut flash, &case.new.bytes()).is_err());
            flash.power_up();
            case.settle(&mut flash);
            confirm(&mut flash);
            cuts += 1;
        }
    }
    println!("{cuts} cuts, four updates in a row");
}
