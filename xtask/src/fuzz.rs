//! `cargo xtask fuzz`: libFuzzer searches for inputs that break a rule.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};

use crate::command::{cargo, root, run, target_dir};

/// The flags for the instrumentation, the same as cargo-fuzz sets. There is no sanitizer, because the code under test
/// has no `unsafe`. All flags are stable.
const INSTRUMENTED: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares -Cdebug-assertions -Coverflow-checks -Ccodegen-units=1";

/// The greatest length of an input: some hundred steps.
const LONGEST: &str = "-max_len=2000";

/// The target triple of the host. With an explicit target, build scripts are not instrumented.
const HOST: &str = env!("XTASK_HOST");

/// The flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// The code to fuzz
    target: Target,
    /// How long to search, in seconds
    #[arg(long = "for", default_value_t = 60, value_name = "SECONDS")]
    seconds: u32,
    /// Add inputs with new coverage to host-tests/fuzz/corpus, which the tests replay
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

/// Fuzzes one target. An input that breaks a rule is written to target/fuzz, and the command fails.
pub(crate) fn run_fuzzer(flags: &Flags) -> Result<()> {
    let value = flags.target.to_possible_value().context("a target has a name")?;
    let name = value.get_name();
    let program = build(name)?;
    let corpus = root().join("host-tests/fuzz/corpus").join(name).with_extension("hex");
    let found = target_dir().join("fuzz").join(name);
    unpack(&corpus, &found)?;
    let broken = found.with_extension("broken-");
    run(fuzzer(&program)
        .arg(format!("-max_total_time={}", flags.seconds))
        .arg(format!("-artifact_prefix={}", broken.display()))
        .args(["-len_control=0", "-print_final_stats=1"])
        .arg(&found))
    .with_context(|| format!("what breaks a rule is in {}*", broken.display()))?;
    if flags.keep { keep(&program, &found, &corpus) } else { Ok(()) }
}

/// Unpacks the corpus into a file for each input, as libFuzzer needs it.
fn unpack(corpus: &Path, found: &Path) -> Result<()> {
    fs::create_dir_all(found).with_context(|| format!("cannot make {}", found.display()))?;
    let text = fs::read_to_string(corpus).with_context(|| format!("cannot read {}", corpus.display()))?;
    for (number, line) in (1..).zip(text.lines()) {
        let input = hex::decode(line).with_context(|| format!("{}:{number}", corpus.display()))?;
        fs::write(found.join(format!("corpus-{number}")), input)?;
    }
    Ok(())
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

/// Replaces the corpus by the smallest set of inputs with the same coverage: a line for each input, the shortest first.
fn keep(program: &Path, found: &Path, corpus: &Path) -> Result<()> {
    let smallest = found.with_extension("smallest");
    fs::create_dir_all(&smallest)?;
    run(fuzzer(program).arg("-set_cover_merge=1").args([&smallest, found]))?;
    let mut inputs = Vec::new();
    for entry in fs::read_dir(&smallest)? {
        inputs.push(fs::read(entry?.path())?);
    }
    inputs.sort_by_key(|input| (input.len(), input.clone()));
    let lines: Vec<String> = inputs.iter().map(|input| hex::encode(input) + "\n").collect();
    fs::write(corpus, lines.concat())?;
    fs::remove_dir_all(&smallest)?;
    Ok(())
}
