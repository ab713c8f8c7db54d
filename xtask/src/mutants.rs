//! `cargo xtask mutants`: checks by cargo-mutants whether the tests of the pure crates notice changes of the code.
//!
//! `.cargo/mutants.toml` tells which code is changed.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;
use clap::Args;

use crate::command::{cargo, run, target_dir};
use crate::tools;

/// A crate that is mutated.
struct Mutated {
    /// Its name in the command.
    name: &'static str,
    package: &'static str,
    /// Arguments of cargo, beside the package. No examples of the documentation: building them takes longer than
    /// running all tests.
    tests: &'static [&'static str],
    profile: &'static str,
}

/// Quick to build. The tests are quick enough.
const QUICK: &str = "mutants";

const fn alone(name: &'static str, package: &'static str) -> Mutated {
    Mutated { name, package, tests: &["--lib", "--tests"], profile: QUICK }
}

const CRATES: [Mutated; 5] = [
    alone("profiles", "profiles"),
    alone("storage", "storage"),
    alone("update", "update"),
    Mutated {
        name: "canopen",
        package: "canopen-device",
        tests: &["--lib", "--tests", "--features=embedded-can"],
        profile: QUICK,
    },
    // A node is what its crates make together. Its tests take twelve times as long in the quick profile.
    Mutated {
        name: "node",
        package: "node",
        tests: &["--lib", "--package=host-tests", "--test=node"],
        profile: "sim",
    },
];

/// The same few inputs for every mutant, and no search for a smaller failing input.
const PROPTEST: [(&str, &str); 3] =
    [("PROPTEST_RNG_SEED", "1"), ("PROPTEST_CASES", "32"), ("PROPTEST_MAX_SHRINK_ITERS", "0")];

/// The flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// The crates to mutate [default: all of them]
    #[arg(value_parser = CRATES.map(|of| of.name))]
    crates: Vec<String>,
    /// Run one of several parts of each crate: `0/8` is the first of eight
    #[arg(long, value_name = "PART/PARTS")]
    shard: Option<String>,
    /// Build and test this many mutants at a time
    #[arg(long, default_value_t = 1)]
    jobs: u8,
}

/// Prints the mutants that no test notices; the logs are in target/mutants. Fails when there is one.
pub(crate) fn print(flags: &Flags) -> Result<()> {
    let path = tools::with("cargo-mutants")?;
    let is_named = |of: &&Mutated| flags.crates.is_empty() || flags.crates.iter().any(|name| name == of.name);
    let mut outcome = Ok(());
    for of in CRATES.iter().filter(is_named) {
        let logs = target_dir().join("mutants").join(of.name);
        fs::create_dir_all(&logs)?;
        // The other crates are tried all the same.
        outcome = outcome.and(run(command(of, flags, &logs).env("PATH", &path)));
    }
    outcome
}

fn command(of: &Mutated, flags: &Flags, logs: &Path) -> Command {
    let mut command = cargo();
    command.args(["mutants", "--colors", "never", "--output"]).arg(logs);
    command.args(["--package", of.package, "--profile", of.profile]);
    command.args(of.tests.iter().map(|argument| format!("--cargo-arg={argument}")));
    if let Some(shard) = &flags.shard {
        command.args(["--sharding", "round-robin", "--shard", shard]);
    }
    command.arg(format!("--jobs={}", flags.jobs)).env("RUST_BACKTRACE", "0").envs(PROPTEST);
    command
}
