//! The power is cut at every flash operation of whole updates, and again in the recovery.

mod common;

use common::{Image, SECTORS, flash_with, holds, image_a, image_b, noise, start, update};
use update::mock::{MockFlash, Weak};
use update::{Decision, Refusal, Stay};

const WAYS: [Weak; 3] = [Weak::Before, Weak::After, Weak::Random];

/// What starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Runs {
    Old,
    New,
    Nothing,
}

/// A node before an update, and the update.
struct Case {
    flash: MockFlash,
    old: Option<Image>,
    new: Image,
}

impl Case {
    /// A node that runs A, which came by an update.
    fn from_a_to_b() -> Case {
        Case { flash: flash_with(&image_a(), 1), old: Some(image_a()), new: image_b() }
    }

    /// A node that was never programmed.
    fn from_nothing_to_b() -> Case {
        Case { flash: MockFlash::new(&SECTORS, 1), old: None, new: image_b() }
    }

    fn operations(&self) -> u32 {
        let mut flash = self.flash.clone();
        update(&mut flash, &self.new.bytes()).unwrap();
        flash.operations() - self.flash.operations()
    }

    /// The flash after the power was cut in this operation of the update.
    fn cut(&self, operation: u32, weak: Weak) -> MockFlash {
        let mut flash = self.flash.clone();
        flash.cut_after(operation, weak);
        assert!(update(&mut flash, &self.new.bytes()).is_err());
        assert!(flash.is_down());
        flash.power_up();
        flash
    }

    /// Starts the node; the answer must be one of the whole images, or nothing where there was nothing.
    fn start(&self, flash: &mut MockFlash) -> Runs {
        match (start(flash), &self.old) {
            (Decision::Start(header), Some(old)) if header == old.header && holds(flash, old) => Runs::Old,
            (Decision::Start(header), _) if header == self.new.header && holds(flash, &self.new) => Runs::New,
            (Decision::Stay(Stay::NoProgram(Refusal::UnknownFormat)), None) => Runs::Nothing,
            (decision, _) => panic!("neither old nor new: {decision:?}"),
        }
    }

    /// Starts the node, and again: what one start decides holds.
    fn settle(&self, flash: &mut MockFlash) -> Runs {
        let runs = self.start(flash);
        flash.power_up();
        assert_eq!(self.start(flash), runs, "decided once");
        runs
    }

    /// Cuts everywhere; returns the number of cuts and how many left the new image.
    fn cut_everywhere(&self, mut check: impl FnMut(&Case, MockFlash)) -> u32 {
        let total = self.operations();
        for operation in 0..total {
            for weak in WAYS {
                check(self, self.cut(operation, weak));
            }
        }
        total * 3
    }
}

#[test]
fn after_a_cut_anywhere_the_old_or_the_new_image_starts_and_the_next_update_succeeds() {
    let mut count = [0; 3];
    let mut check = |case: &Case, mut flash: MockFlash| {
        let runs = case.settle(&mut flash);
        count[runs as usize] += 1;
        if runs != Runs::New {
            update(&mut flash, &case.new.bytes()).unwrap();
            assert_eq!(case.settle(&mut flash), Runs::New);
        }
    };
    let cuts = Case::from_a_to_b().cut_everywhere(&mut check);
    let cuts = cuts + Case::from_nothing_to_b().cut_everywhere(&mut check);
    println!("{cuts} cuts: {count:?} left the old image, the new one, none where there was none");
    assert_eq!(count.iter().sum::<u32>(), cuts);
    assert!(count.iter().all(|&count| count > 500));
}

#[test]
fn a_second_cut_in_the_recovery_changes_nothing() {
    let mut cuts = 0;
    let case = Case::from_a_to_b();
    case.cut_everywhere(|case, first| {
        let mut flash = first.clone();
        let runs = case.start(&mut flash);
        let recovery = flash.operations() - first.operations();
        for _ in 0..2.min(recovery) {
            let mut flash = first.clone();
            let chance = noise(u64::from(cuts), 4);
            let operation = u32::from_le_bytes(chance.try_into().unwrap()) % recovery;
            flash.cut_after(operation, WAYS[operation as usize % 3]);
            start(&mut flash);
            assert!(flash.is_down());
            flash.power_up();
            let again = case.settle(&mut flash);
            // A torn commit that the cut kept from being revoked may yet read well.
            assert!(again == runs || recovery <= 4, "{runs:?} became {again:?}");
            cuts += 1;
        }
    });
    println!("{cuts} second cuts in the recovery");
    assert!(cuts > 500);
}

#[test]
fn a_cut_in_the_update_that_follows_a_cut_loses_nothing() {
    let mut cuts = 0;
    let case = Case::from_a_to_b();
    let total = case.operations();
    for seed in 0..300_u32 {
        let chance = noise(u64::from(seed) + 1000, 16);
        let mut flash = case.flash.clone();
        for at in chance.chunks(4) {
            let at = u32::from_le_bytes(at.try_into().unwrap()) % total;
            flash.cut_after(at, WAYS[at as usize % 3]);
            if update(&mut flash, &case.new.bytes()).is_ok() {
                break;
            }
            cuts += 1;
            flash.power_up();
            case.settle(&mut flash);
        }
    }
    println!("{cuts} cuts, four updates in a row");
    assert!(cuts > 500);
}
