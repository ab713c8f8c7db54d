//! `cargo xtask test`: every check of the project.
//!
//! Two lanes at a time compile, one for this machine and one for the Cortex-M4. Then the tests run, each in a process of its own: as
//! many at a time as there are cores, and as many again of those that mostly wait. The two lanes go on beside them with lints and
//! documentation. A step or a test that fails has its output printed; the output of all is in target/test-logs.

mod checks;
mod host;
mod report;
pub(crate) mod suite;

use anyhow::Result;
use clap::Args;

use crate::setup;
use checks::{builds_for_host, builds_for_target, checks_for_host, checks_for_target};
use report::Report;

/// Flags of the command.
#[derive(Args)]
pub(crate) struct Flags {
    /// Run only the steps and the tests whose name contains this text
    #[arg(long)]
    only: Option<String>,
    /// Run whole what is otherwise sampled: exhaustive power cuts, long random runs
    #[arg(long)]
    thorough: bool,
}

/// Runs everything, or what the flags leave of it.
pub(crate) fn run(flags: &Flags) -> Result<()> {
    let needs = if flags.thorough { setup::THOROUGH } else { setup::TEST };
    setup::check(needs)?;
    let report = Report::new(flags.only.as_deref())?;
    report.run([builds_for_host(), builds_for_target(needs, flags.thorough)], Vec::new())?;
    let tests = suite::collect(flags.thorough, report.only())?;
    report.run([checks_for_host(), checks_for_target()], tests)?;
    report.finish()
}
