//! Power cuts at every single operation of a long scenario, and again at every operation of the recovery; on a flash
//! that programs words of four bytes (STM32F4), and on one that programs words of eight (STM32G4, L4).

use crate::model::{
    EMPTY, Model, Step, after, as_changes, noise, read_good, recover, restore, run, set, start,
};
use storage::mock::{MockFlash, Weak};
use storage::{GroupNumber, Pages};

/// Small pages make page moves frequent. With two erase units per page, an erase can be cut between the units.
const fn pages(word: usize) -> Pages {
    Pages::new(256, 256).with_words(word as u32)
}
type Flash<const WORD: usize> = MockFlash<128, WORD>;

const WAYS: [Weak; 3] = [Weak::Before, Weak::After, Weak::Random];

fn flash<const WORD: usize>(seed: u64) -> Flash<WORD> {
    Flash::new(1024, seed)
}

/// Saves of one and of several groups, of empty values, restores, both pages filled, and restarts that erase.
fn scenario() -> Vec<Step> {
    use GroupNumber::{Four, One, Three, Two};
    let save = |changes: &[_]| Step::Save(changes.to_vec());
    vec![
        save(&[set(One, 1, 4)]),
        save(&[set(Two, 2, 17), set(Three, 3, 30)]),
        save(&[set(Three, 4, 31), restore(Two)]),
        Step::Restart,
        save(&[set(Two, 5, 0), set(Four, 6, 8), set(One, 7, 4)]),
        save(&[set(Three, 8, 40), set(Two, 9, 12)]),
        save(&[restore(Three)]),
        save(&[set(Three, 10, 25)]),
        Step::Restart,
        save(&[set(Three, 11, 25), set(Two, 12, 20)]),
        save(&[set(One, 13, 4)]),
        Step::Restart,
        Step::Restart,
        save(&[set(Three, 14, 33), set(One, 15, 4), restore(Four)]),
        save(&[set(Three, 16, 33)]),
        Step::MakeRoom,
        save(&[set(Three, 17, 60), set(Two, 18, 40)]),
        Step::MakeRoom,
        save(&[set(Four, 19, 50)]),
        save(&[set(Four, 20, 50)]),
        Step::MakeRoom,
    ]
}

fn operations_of<const WORD: usize>(run_it: impl FnOnce(&mut Flash<WORD>), flash: &Flash<WORD>) -> u32 {
    let mut flash = flash.clone();
    let before = flash.operations();
    run_it(&mut flash);
    flash.operations() - before
}

fn without_a_cut_the_scenario_moves_pages_and_agrees_with_the_model<const WORD: usize>() {
    let mut flash = flash::<WORD>(0);
    let end = run(&mut flash, pages(WORD), &scenario(), EMPTY);
    assert_eq!(vec![read_good(&mut flash, pages(WORD))], end);
    assert_eq!(flash.erases()[..2], [0, 0], "nothing outside the pages is erased");
    assert!(flash.erases()[2..6].iter().all(|&erases| erases >= 2), "{:?}", flash.erases());
}

/// Every state of the flash that a cut in the scenario can leave, with the states that may be read.
fn cut_everywhere<const WORD: usize>(mut check: impl FnMut(Flash<WORD>, Vec<Model>)) -> u32 {
    let total = operations_of(|flash| drop(run(flash, pages(WORD), &scenario(), EMPTY)), &flash::<WORD>(0));
    for operation in 0..total {
        for weak in WAYS {
            let mut flash = flash::<WORD>(u64::from(operation));
            flash.cut_after(operation, weak);
            let allowed = run(&mut flash, pages(WORD), &scenario(), EMPTY);
            assert!(flash.is_down());
            check(flash, allowed);
        }
    }
    total
}

fn a_cut_at_any_operation_leaves_the_old_or_the_new_groups_and_saves_continue<const WORD: usize>() {
    let mut news = 0;
    let total = cut_everywhere::<WORD>(|mut flash, allowed| {
        let model = recover(&mut flash, pages(WORD), &allowed);
        news += u32::from(allowed.len() == 2 && model == allowed[0]);
        let changes = vec![set(GroupNumber::Two, 99, 21), restore(GroupNumber::One)];
        start(&mut flash, pages(WORD)).unwrap().save(&as_changes(&changes)).unwrap();
        assert_eq!(read_good(&mut flash, pages(WORD)), after(&model, &changes));
    });
    assert!(news > 20, "some cuts come after the commit: {news} of {total}");
}

fn a_second_cut_at_any_operation_of_the_recovery_changes_nothing<const WORD: usize>() {
    let mut cuts = 0;
    cut_everywhere::<WORD>(|mut first, allowed| {
        first.power_up();
        let recovery = operations_of(|flash| drop(start(flash, pages(WORD))), &first);
        for operation in 0..recovery {
            let mut flash = first.clone();
            flash.cut_after(operation, WAYS[operation as usize % WAYS.len()]);
            assert!(start(&mut flash, pages(WORD)).is_err());
            recover(&mut flash, pages(WORD), &allowed);
            cuts += 1;
        }
    });
    println!("second cuts: {cuts}");
    assert!(cuts > 1000);
}

fn a_dozen_cuts_in_a_row_lose_nothing<const WORD: usize>() {
    for seed in 0..200 {
        let mut flash = flash::<WORD>(seed);
        let mut model = EMPTY;
        for round in 0..12 {
            let changes = vec![set(GroupNumber::One, round, 4), set(GroupNumber::Three, round + 100, 30)];
            let steps = [Step::Save(changes.clone()), Step::Restart, Step::Save(changes)];
            let at = noise(seed * 100 + u64::from(round), 1)[0];
            flash.cut_after(u32::from(at) % 60, Weak::Random);
            let allowed = run(&mut flash, pages(WORD), &steps, model);
            model = recover(&mut flash, pages(WORD), &allowed);
        }
    }
}

/// Words of four bytes.
mod words_of_four_bytes {
    #[test]
    fn without_a_cut_the_scenario_moves_pages_and_agrees_with_the_model() {
        super::without_a_cut_the_scenario_moves_pages_and_agrees_with_the_model::<4>();
    }

    #[test]
    fn a_cut_at_any_operation_leaves_the_old_or_the_new_groups_and_saves_continue() {
        super::a_cut_at_any_operation_leaves_the_old_or_the_new_groups_and_saves_continue::<4>();
    }

    #[test]
    fn a_second_cut_at_any_operation_of_the_recovery_changes_nothing() {
        super::a_second_cut_at_any_operation_of_the_recovery_changes_nothing::<4>();
    }

    #[test]
    fn a_dozen_cuts_in_a_row_lose_nothing() {
        super::a_dozen_cuts_in_a_row_lose_nothing::<4>();
    }
}

/// Words of eight bytes.
mod words_of_eight_bytes {
    #[test]
    fn without_a_cut_the_scenario_moves_pages_and_agrees_with_the_model() {
        super::without_a_cut_the_scenario_moves_pages_and_agrees_with_the_model::<8>();
    }

    #[test]
    fn a_cut_at_any_operation_leaves_the_old_or_the_new_groups_and_saves_continue() {
        super::a_cut_at_any_operation_leaves_the_old_or_the_new_groups_and_saves_continue::<8>();
    }

    #[test]
    fn a_second_cut_at_any_operation_of_the_recovery_changes_nothing() {
        super::a_second_cut_at_any_operation_of_the_recovery_changes_nothing::<8>();
    }

    #[test]
    fn a_dozen_cuts_in_a_row_lose_nothing() {
        super::a_dozen_cuts_in_a_row_lose_nothing::<8>();
    }
}
