//! The state of the cells after a power cut, and the rules that the model enforces.

use storage::cells::{Cells, PowerCut, Weak};

const OLD: [u8; 4] = [0x12, 0x34, 0x56, 0x78];

/// Two words, the first of which loses power while it is programmed with [`OLD`].
fn cut_in_a_program(weak: Weak) -> Cells {
    let mut cells = Cells::new(8, 1);
    cells.cut_after(0, weak);
    assert_eq!(cells.program(0, &OLD), Err(PowerCut));
    assert!(cells.is_down());
    assert_eq!(cells.read(0, &mut [0; 4]), Err(PowerCut));
    cells.power_up();
    cells
}

fn first(cells: &Cells) -> [u8; 4] {
    cells.bytes()[..4].try_into().unwrap()
}

#[test]
fn a_word_reads_as_the_cut_left_it() {
    assert_eq!(first(&cut_in_a_program(Weak::Before)), [0xFF; 4]);
    assert_eq!(first(&cut_in_a_program(Weak::After)), OLD);
}

#[test]
fn a_weak_word_changes_from_one_power_up_to_the_next() {
    let mut cells = cut_in_a_program(Weak::Either);
    let mut seen = Vec::new();
    for _ in 0..20 {
        seen.push(first(&cells));
        cells.power_up();
    }
    assert!(seen.contains(&OLD) && seen.contains(&[0xFF; 4]), "{seen:?}");
    assert!(seen.iter().all(|word| [OLD, [0xFF; 4]].contains(word)), "{seen:?}");
}

#[test]
fn chance_touches_only_the_bits_that_were_to_change() {
    for seed in 0..50 {
        let mut cells = Cells::new(4, seed);
        cells.cut_after(0, Weak::Random);
        cells.program(0, &OLD).unwrap_err();
        cells.power_up();
        assert!(first(&cells).iter().zip(OLD).all(|(byte, old)| byte & old == old));
    }
}

#[test]
fn zeros_and_an_erase_end_the_doubt() {
    let mut cells = cut_in_a_program(Weak::Random);
    cells.program(0, &[0; 4]).unwrap();
    cells.power_up();
    assert_eq!(first(&cells), [0; 4]);
    cells.erase(0..8).unwrap();
    cells.program(0, &OLD).unwrap();
    assert_eq!((first(&cells), cells.operations(), cells.programmed()), (OLD, 4, 2));
}

#[test]
#[should_panic(expected = "not erased")]
fn a_word_that_was_cut_without_a_trace_is_not_programmed_again() {
    let mut cells = cut_in_a_program(Weak::Before);
    let _ = cells.program(0, &OLD);
}

#[test]
#[should_panic(expected = "not erased")]
fn a_word_whose_erase_was_cut_is_not_programmed() {
    let mut cells = Cells::new(4, 1);
    cells.program(0, &OLD).unwrap();
    cells.cut_after(0, Weak::After);
    cells.erase(0..4).unwrap_err();
    cells.power_up();
    let _ = cells.program(0, &OLD);
}
