//! `cargo xtask matrix`: the tests of the matrix in full, and the table of what ran where.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::command::{built, root, run, target_dir};
use crate::images;
use crate::own_tool::{self, Tools};
use crate::setup::{emulator, python};
use crate::test::suite::{with_images, with_programs};

/// The variable with the file that gets a line for each case.
pub(crate) const LOG: &str = "MATRIX_LOG";
/// The marks around the table in docs/evidence.md.
const BEGIN: &str = "<!-- begin matrix -->\n";
const END: &str = "<!-- end matrix -->";

/// The cases of a test.
#[derive(Default)]
struct Ran {
    cases: BTreeSet<(String, u16, u16)>,
}

/// Runs the tests of the matrix in all cases and writes their table into docs/evidence.md.
pub(crate) fn write() -> Result<()> {
    let log = target_dir().join("matrix.txt");
    let _ = fs::remove_file(&log);
    images::build(Tools::ByCargo)?;
    let mut tests = emulator::cargo_with_emulator()?;
    tests.args(["test", "--profile", "sim", "-p", "host-tests", "--features", "board", "--test", "matrix"]);
    run(with_images(tests.env(LOG, &log), true))?;
    own_tool::build_simulator("tools")?;
    let mut clients = Command::new(python::clients()?);
    clients.args(["-m", "pytest", "-q", "host-tests/python/test_matrix.py"]).current_dir(root());
    clients.env("IO_MODULE_COMMAND", built("examples/io_module")).env(LOG, &log);
    run(with_images(with_programs(&mut clients), true))?;
    let text = fs::read_to_string(&log).with_context(|| format!("cannot read {}", log.display()))?;
    put(&table(&text))
}

/// The table of a log.
fn table(log: &str) -> String {
    let mut tests: BTreeMap<&str, Ran> = BTreeMap::new();
    for line in log.lines() {
        let &[test, personality, node, kbit] = line.split('\t').collect::<Vec<_>>().as_slice() else {
            continue;
        };
        if let (Ok(node), Ok(kbit)) = (node.parse(), kbit.parse()) {
            tests.entry(test).or_default().cases.insert((personality.to_owned(), node, kbit));
        }
    }
    let mut lines = vec![
        "| test | cases | personalities | node-IDs | kbit/s |".to_owned(),
        "|---|---|---|---|---|".to_owned(),
    ];
    for (test, Ran { cases }) in &tests {
        let list = |values: BTreeSet<String>| values.into_iter().collect::<Vec<_>>().join(", ");
        let numbers = |values: BTreeSet<u16>| {
            values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(", ")
        };
        lines.push(format!(
            "| {test} | {} | {} | {} | {} |",
            cases.len(),
            list(cases.iter().map(|case| case.0.clone()).collect()),
            numbers(cases.iter().map(|case| case.1).collect()),
            numbers(cases.iter().map(|case| case.2).collect()),
        ));
    }
    lines.join("\n") + "\n"
}

/// Puts the table between its marks.
fn put(table: &str) -> Result<()> {
    let path: PathBuf = root().join("docs/evidence.md");
    let text = fs::read_to_string(&path)?;
    let parts = text.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    ensure!(parts.is_some(), "{} has no place for the table", path.display());
    let (before, after) = parts.unwrap_or_default();
    fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).context("cannot write the table")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_is_a_row_with_its_cases() {
        let log =
            "NMT on the board\tlift\t16\t250\nNMT on the board\tencoder\t1\t10\n\nEMCY\tlift\t127\t1000\n";
        let table = table(log);
        assert!(table.contains("| NMT on the board | 2 | encoder, lift | 1, 16 | 10, 250 |"), "{table}");
        assert!(table.contains("| EMCY | 1 | lift | 127 | 1000 |"), "{table}");
    }
}
