//! `cargo xtask regressions`: brings each mended fault back and expects the monitor to report it.
//!
//! The sources are copied into the build directory. For each mend of the table, the fault is put into the copy, and the
//! scenario of the fault is run there: the monitor must end it. Without a fault, all scenarios of the table must pass.

mod table;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::command::{cargo, root, target_dir};
use table::{Edit, MENDS, Mend};

/// The line with which a monitor ends a test.
const REPORT: &str = "the monitor reports a breach:";

/// The flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// Only the mends of these findings
    #[arg(long, value_name = "FINDING", value_delimiter = ',')]
    only: Vec<String>,
    /// Print the findings with their rules and scenarios, and end
    #[arg(long)]
    list: bool,
}

/// Tries every mend, and prints a line for each.
pub(crate) fn run(flags: &Flags) -> Result<()> {
    let is_chosen =
        |mend: &&Mend| flags.only.is_empty() || flags.only.iter().any(|name| name == mend.finding);
    let mends: Vec<&Mend> = MENDS.iter().filter(is_chosen).collect();
    ensure!(!mends.is_empty(), "no mend has such a name; --list has them all");
    if flags.list {
        mends.iter().for_each(|mend| println!("{:<12} {:<17} {}", mend.finding, mend.rule, mend.scenario));
        return Ok(());
    }
    let copy = Copy::make()?;
    for scenario in scenarios(&mends) {
        let output = copy.run(scenario)?;
        ensure!(output.status.success(), "{scenario} fails without a fault:\n{}", text(&output));
    }
    println!("{} scenarios pass without a fault", scenarios(&mends).len());
    let mut missed = Vec::new();
    for mend in &mends {
        let reported = copy.with(mend)?;
        println!("{:<12} {}", mend.finding, reported.as_deref().unwrap_or("NOT REPORTED"));
        missed.extend(reported.is_none().then_some(mend.finding));
    }
    ensure!(missed.is_empty(), "{} of {} are not reported: {}", missed.len(), mends.len(), missed.join(", "));
    println!("{} of {} faults are reported by the monitor", mends.len(), mends.len());
    Ok(())
}

/// The scenarios of these mends, each once.
fn scenarios(mends: &[&Mend]) -> Vec<&'static str> {
    let mut scenarios: Vec<_> = mends.iter().map(|mend| mend.scenario).collect();
    scenarios.sort_unstable();
    scenarios.dedup();
    scenarios
}

/// The copy of the sources.
struct Copy {
    tree: PathBuf,
    target: PathBuf,
}

impl Copy {
    /// Copies all files that git tracks, in their present state. A file that has not changed keeps its time, so that cargo
    /// compiles only what has.
    fn make() -> Result<Copy> {
        let home = target_dir().join("regressions");
        let copy = Copy { tree: home.join("tree"), target: home.join("target") };
        let list = Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output();
        let list = list.context("cannot start git")?;
        ensure!(list.status.success(), "git does not list the files");
        for name in String::from_utf8_lossy(&list.stdout).split('\0').filter(|name| !name.is_empty()) {
            let (from, to) = (root().join(name), copy.tree.join(name));
            let Ok(content) = fs::read(&from) else { continue };
            if fs::read(&to).is_ok_and(|old| old == content) {
                continue;
            }
            if let Some(folder) = to.parent() {
                fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
            }
            fs::write(&to, content).with_context(|| format!("cannot write {}", to.display()))?;
        }
        Ok(copy)
    }

    /// Runs one scenario in the copy. Assertions of the library are off: the monitor has to notice the fault.
    fn run(&self, scenario: &str) -> Result<Output> {
        let arguments = ["test", "--quiet", "--profile", "sim", "-p", "host-tests", "--test", "scenarios"];
        let mut command = cargo();
        command
            .args(arguments)
            .args(["--config", "profile.sim.package.canopen-device.debug-assertions=false"])
            .args(["--", "--exact", scenario])
            .current_dir(&self.tree)
            .env("CARGO_TARGET_DIR", &self.target)
            .env("RUST_BACKTRACE", "0");
        command.output().context("cannot start cargo")
    }

    /// Puts a fault into the copy, runs its scenario, and takes the fault out. Returns the report of the monitor about
    /// the rule; `None` without one.
    fn with(&self, mend: &Mend) -> Result<Option<String>> {
        let mut before = Vec::new();
        let result = self.put_in(mend, &mut before).and_then(|()| self.run(mend.scenario));
        for (path, content) in before.iter().rev() {
            write(path, content)?;
        }
        let output = result.with_context(|| format!("{}: {}", mend.finding, mend.scenario))?;
        let text = text(&output);
        ensure!(!text.contains("error: could not compile"), "{} does not compile:\n{text}", mend.finding);
        ensure!(!text.contains("running 0 tests"), "{}: no scenario {}", mend.finding, mend.scenario);
        let mut lines = text.lines().skip_while(|line| !line.ends_with(REPORT)).skip(1);
        let report = lines.next().filter(|line| line.contains(&format!(": {}: ", mend.rule)));
        Ok(report.map(str::to_owned))
    }

    fn put_in(&self, mend: &Mend, before: &mut Vec<(PathBuf, String)>) -> Result<()> {
        for edit in mend.edits {
            let Edit { file, mended, fault } = edit;
            let path = self.tree.join(file);
            let content = fs::read_to_string(&path).with_context(|| format!("cannot read {file}"))?;
            let count = content.matches(mended).count();
            if count != 1 {
                bail!("{}: the text of the mend is {count} times in {file}:\n{mended}", mend.finding);
            }
            let broken = content.replacen(mended, fault, 1);
            before.push((path.clone(), content));
            write(&path, &broken)?;
        }
        Ok(())
    }
}

/// Writes a file with a new time, so that cargo compiles it.
fn write(path: &Path, content: &str) -> Result<()> {
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))?;
    let file = fs::File::options().write(true).open(path)?;
    file.set_modified(SystemTime::now()).with_context(|| format!("cannot touch {}", path.display()))
}

fn text(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    format!("{err}{out}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mend_is_in_its_file_once() {
        for Mend { finding, edits, .. } in MENDS {
            for Edit { file, mended, .. } in *edits {
                let content = fs::read_to_string(root().join(file)).expect(file);
                assert_eq!(content.matches(mended).count(), 1, "{finding}: {file}: {mended}");
            }
        }
    }
}
