//! `cargo xtask bench`: builds the programs of bench/ and counts their instructions.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::command::{root, run, target_dir};
use crate::own_tool::Tools;
use crate::progress;
use crate::target::{TRIPLE, Toolchain};

/// The flags of the command.
#[derive(Args, Default)]
pub(crate) struct Options {
    /// Optimise for speed (opt-level 2), not for size as the firmware is
    #[arg(long)]
    speed: bool,
    /// Write the tables into docs/performance.md
    #[arg(long)]
    write: bool,
    /// Fail when a number of ours is more than a few per cent worse than docs/performance.md states
    #[arg(long, conflicts_with = "write")]
    check: bool,
    /// Measure the sizes for a Cortex-M0+ too (thumbv6m-none-eabi); `--write` does so in any case
    #[arg(long)]
    small: bool,
    /// Instead of the tables, say where the instructions of the operations are whose name contains this
    #[arg(long, value_name = "OPERATION")]
    profile: Option<String>,
    /// Instead of the tables, print the bytes of each module of the library in our devices
    #[arg(long)]
    by_module: bool,
}

impl Options {
    /// The cargo profile for the programs, which is also the name of its directory.
    fn cargo_profile(&self) -> &'static str {
        if self.speed { "speed" } else { "release" }
    }
}

/// Builds the programs and runs the bench tool on them.
pub(crate) fn measure(options: &Options, tools: Tools) -> Result<()> {
    let images = build(options)?;
    let page = root().join("docs/performance.md");
    let mut command = tools.get("bench")?;
    command.arg("--images").arg(images);
    if options.speed {
        command.arg("--speed");
    }
    if options.write {
        command.arg("--write").arg(&page);
    }
    if options.check {
        command.arg("--check").arg(&page);
    }
    if let Some(operation) = &options.profile {
        command.arg("--profile").arg(operation);
    }
    if options.small || options.write {
        command.arg("--small").arg(build_small(options)?);
    }
    if options.by_module {
        command.arg("--by-module");
    }
    run(&mut command)
}

/// The step of the test command: fails when the flashed code has become worse than docs/performance.md states.
pub(crate) fn check() -> Result<()> {
    measure(&Options { check: true, ..Options::default() }, Tools::Built)
}

/// The target of the smallest microcontrollers.
const SMALL: &str = "thumbv6m-none-eabi";

/// Builds our programs for a Cortex-M0+. Returns their directory.
fn build_small(options: &Options) -> Result<PathBuf> {
    let profile = options.cargo_profile();
    let mut arguments = vec!["--profile", profile, "-p", "bench-images"];
    for image in ["empty", "minimal", "set", "services", "ours"] {
        arguments.extend(["--bin", image]);
    }
    let mut command = Toolchain::ensure()?.cargo_for(SMALL, "build", &arguments);
    // The core has no compare-and-swap; a dependency of another node asks for it.
    command
        .env("CARGO_TARGET_THUMBV6M_NONE_EABI_RUSTFLAGS", "--cfg portable_atomic_unsafe_assume_single_core");
    progress::build("bench images for a Cortex-M0+", &mut command)?;
    Ok(target_dir().join(SMALL).join(profile))
}

/// Builds the measured programs. Returns their directory.
pub(crate) fn build(options: &Options) -> Result<PathBuf> {
    let profile = options.cargo_profile();
    let mut command = Toolchain::ensure()?.cargo("build", &["--profile", profile, "-p", "bench-images"]);
    progress::build("bench images", &mut command)?;
    Ok(target_dir().join(TRIPLE).join(profile))
}
