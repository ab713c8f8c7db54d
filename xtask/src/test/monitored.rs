//! The monitor in the tests: in how many it listened, and how many named a breach.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

use crate::command::target_dir;

/// The variable with the file that gets a line for each bus that a monitor has listened to.
pub(super) const LOG: &str = "MONITOR_LOG";

/// The file.
pub(super) fn log() -> PathBuf {
    target_dir().join("test-logs/monitor.txt")
}

/// Forgets the last run.
pub(super) fn begin() {
    let _ = fs::remove_file(log());
}

/// Prints the counts.
pub(super) fn print() {
    let text = fs::read_to_string(log()).unwrap_or_default();
    if !text.is_empty() {
        eprintln!("\n{}", summary(&text));
    }
}

/// The counts of a log: a line has a test, its frames and the rules that the test breaks.
fn summary(log: &str) -> String {
    let mut tests: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    let mut frames = 0_u64;
    for line in log.lines() {
        let &[test, count, rules] = line.split('\t').collect::<Vec<_>>().as_slice() else { continue };
        frames += count.parse::<u64>().unwrap_or(0);
        tests.entry(test).or_default().extend(rules.split(',').filter(|rule| !rule.is_empty()));
    }
    let named = tests.values().filter(|rules| !rules.is_empty()).count();
    format!("the monitor listened in {} tests to {frames} frames; {named} tests name a breach", tests.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_with_several_buses_counts_once() {
        let log = "a::b\t10\t\na::b\t5\temcy\nc\t1\t\n";
        let expected = "the monitor listened in 2 tests to 16 frames; 1 tests name a breach";
        assert_eq!(summary(log), expected);
    }
}
