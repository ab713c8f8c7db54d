//! Bugs as the authors of firmware make them, each seeded into the images as they are: what does the board say?
//!
//! A row of [`table::STORES`] changes what the program stores into a register, as a wrong constant or a missing line would do; a row
//! of [`table::CODE`] puts other instructions at the beginning of an interrupt handler while the program runs: at its start the bootloader
//! finds the image changed. What the board says is everything by which an
//! engineer notices on the bench: broken rules, faults and resets, accesses without a model, and what is wrong on the bus.

mod table;

use crate::scenario::{Node, observe};
use crate::support::world;
use table::{CODE, Row, STORES};

/// So that several processes share the work.
const PARTS: usize = 4;

/// A row whose words the board does not say, and all that the board says instead.
fn silent(row: &Row) -> Option<String> {
    let said = observe(world(row.node.flags()), row.node, |world| row.seed(world), |world| row.patch(world));
    println!("{}: {}", row.name, said.join("; "));
    let is_told = said.iter().any(|sign| sign.contains(row.says));
    (!is_told).then(|| format!("{}: expected {:?} in {said:#?}", row.name, row.says))
}

/// Every bug of the table whose number has this rest.
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

/// What shows a bug is the bug's.
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
    assert!(names.len() >= 40, "{}", names.len());
}
