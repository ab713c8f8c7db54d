//! `cargo xtask fuzz`: libFuzzer looks for inputs that break a rule.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};

use crate::command::{cargo, root, run, target_dir};

/// What the instrumentation needs, as cargo-fuzz sets it; no sanitizer, for the code under test has no `unsafe`. All of
/// it is stable.
const INSTRUMENTED: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Cdebug-assertions -Coverflow-checks -Ccodegen-units=1";

/// Longest input: some hundred steps.
const LONGEST: &str = "-max_len=2000";

/// The host, named so that build scripts are not instrumented.
const HOST: &str = env!("XTASK_HOST");

/// Flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// What to fuzz
    target: Target,
    /// How long to look, in seconds
    #[arg(long = "for", default_value_t = 60, value_name = "SECONDS")]
    seconds: u32,
    /// Add what covers more to host-tests/fuzz/corpus, which the tests replay
    #[arg(long)]
    keep: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Target {
    /// The whole node: frames, time, readings, resets, power cuts
    Node,
    /// Every codec of the protocol
    Codecs,
    /// The parameter pages
    Pages,
    /// An update: image header, download, power cuts
    Image,
    /// The reader of data sheets
    Sheet,
}

/// Fuzzes one target. What breaks a rule ends in target/fuzz, and the command fails.
pub(crate) fn run_fuzzer(flags: &Flags) -> Result<()> {
    let value = flags.target.to_possible_value().context("a target has a name")?;
    let name = value.get_name();
    let program = build(name)?;
    let corpus = root().join("host-tests/fuzz/corpus").join(name);
    let found = target_dir().join("fuzz").join(name);
    fs::create_dir_all(&found).with_context(|| format!("cannot make {}", found.display()))?;
    let broken = found.join("broken-");
    run(fuzzer(&program)
        .arg(format!("-max_total_time={}", flags.seconds))
        .arg(format!("-artifact_prefix={}", broken.display()))
        .args(["-len_control=0", "-print_final_stats=1"])
        .args([&found, &corpus]))
    .with_context(|| format!("what breaks a rule is in {}", found.display()))?;
    if flags.keep { keep(&program, &found, &corpus) } else { Ok(()) }
}

fn build(name: &str) -> Result<PathBuf> {
    let bin = format!("fuzz-{name}");
    let target = ["--profile", "sim", "--target", HOST];
    run(cargo()
        .args(["build", "--quiet", "-p", "fuzz", "--features", "libfuzzer", "--bin", &bin])
        .args(target)
        .env("RUSTFLAGS", INSTRUMENTED))?;
    let program = target_dir().join(HOST).join("sim").join(bin);
    if !program.exists() {
        bail!("{} was not built", program.display());
    }
    Ok(program)
}

fn fuzzer(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg(LONGEST).current_dir(root());
    command
}

/// The smallest set of inputs that covers as much, in the corpus' place.
fn keep(program: &Path, found: &Path, corpus: &Path) -> Result<()> {
    let smallest = found.with_extension("smallest");
    fs::create_dir_all(&smallest)?;
    run(fuzzer(program).arg("-set_cover_merge=1").args([&smallest, corpus, found]))?;
    fs::remove_dir_all(corpus)?;
    fs::create_dir_all(corpus)?;
    for entry in fs::read_dir(&smallest)? {
        let entry = entry?;
        fs::copy(entry.path(), corpus.join(entry.file_name()))?;
    }
    fs::remove_dir_all(&smallest)?;
    Ok(())
}
