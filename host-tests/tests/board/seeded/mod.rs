//! Typical firmware bugs, each seeded into the finished images: does the emulated board report each of them?
//!
//! A row of [`table::STORES`] changes a store of the program into a register, as a wrong constant or a missing line
//! would do. A row of [`table::CODE`] replaces the first instructions of an interrupt handler while the program runs;
//! before the start, the bootloader would detect the changed image. The report consists of everything that an engineer
//! would notice on the bench: broken rules, faults and resets, accesses without a model, and wrong behaviour on the
//! bus.

mod table;

use crate::scenario::{Node, observe};
use crate::support::{unwatched, world};
use table::{CODE, Row, STORES};

/// Number of parts, so that several processes share the work.
const PARTS: usize = 4;

/// Runs a row; if the expected text is missing, returns the texts reported instead.
fn silent(row: &Row) -> Option<String> {
    let said = observe(
        unwatched("bootloader", row.node.flags()),
        row.node,
        |world| row.seed(world),
        |world| row.patch(world),
    );
    println!("{}: {}", row.name, said.join("; "));
    let is_told = said.iter().any(|sign| sign.contains(row.says));
    (!is_told).then(|| format!("{}: expected {:?} in {said:#?}", row.name, row.says))
}

/// Checks every bug whose number in the table has this remainder.
fn every_bug_shows(rest: usize) {
    let rows = STORES.iter().chain(CODE).enumerate().filter(|(number, _)| number % PARTS == rest);
    let silent: Vec<String> = rows.filter_map(|(_, row)| silent(row)).collect();
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}

#[test]
fn bugs_show_first_part() {
    every_bug_shows(0);
}

#[test]
fn bugs_show_second_part() {
    every_bug_shows(1);
}

#[test]
fn bugs_show_third_part() {
    every_bug_shows(2);
}

#[test]
fn bugs_show_fourth_part() {
    every_bug_shows(3);
}

/// Without a seeded bug the board reports nothing, so that every report above comes from its bug.
#[test]
fn without_a_bug_the_board_says_nothing() {
    for node in [Node::Saving, Node::SlowFifo, Node::Encoder, Node::Absolute] {
        assert_eq!(observe(world(node.flags()), node, |_| (), |_| ()), [""; 0], "{node:?}");
    }
}

#[test]
fn there_are_the_bugs_that_were_asked_for() {
    let names: std::collections::BTreeSet<&str> = STORES.iter().chain(CODE).map(|row| row.name).collect();
    assert_eq!(names.len(), STORES.len() + CODE.len(), "two rows are the same");
    assert!(names.len() >= 120, "{}", names.len());
}
