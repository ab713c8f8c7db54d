//! `cargo xtask mutants`: checks by cargo-mutants whether the tests of the pure crates notice changes of the code.
//!
//! `.cargo/mutants.toml` tells which code is changed.

use anyhow::Result;
use clap::Args;

use crate::command::{cargo, run, target_dir};
use crate::tools;

/// The crates that are mutated by default.
const PACKAGES: [&str; 3] = ["profiles", "storage", "update"];

/// The same inputs for every mutant, and no search for a smaller failing input.
const PROPTEST: [(&str, &str); 2] = [("PROPTEST_RNG_SEED", "1"), ("PROPTEST_MAX_SHRINK_ITERS", "0")];

/// The flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// The crates to mutate [default: profiles storage update]
    packages: Vec<String>,
    /// Run one of several parts: `0/8` is the first of eight
    #[arg(long, value_name = "PART/PARTS")]
    shard: Option<String>,
}

/// Prints the mutants that no test notices, and fails when there is one. The logs are in target/mutants.out.
pub(crate) fn print(flags: &Flags) -> Result<()> {
    let mut command = cargo();
    command.args(["mutants", "--colors", "never", "--output"]).arg(target_dir());
    for package in packages(flags) {
        command.args(["--package", package]);
    }
    if let Some(shard) = &flags.shard {
        command.args(["--shard", shard]);
    }
    run(command.env("PATH", tools::with("cargo-mutants")?).env("RUST_BACKTRACE", "0").envs(PROPTEST))
}

fn packages(flags: &Flags) -> Vec<&str> {
    if flags.packages.is_empty() {
        PACKAGES.to_vec()
    } else {
        flags.packages.iter().map(String::as_str).collect()
    }
}
