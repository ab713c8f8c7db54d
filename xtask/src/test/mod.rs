//! `cargo xtask test`: every check of the project.
//!
//! Two lanes compile at the same time, one for this machine and one for the Cortex-M4. Then the tests run, each in a
//! process of its own: one test per core, and two per core of the tests that mostly wait. The two lanes go on beside
//! the tests with lints and documentation. The output of a failed step or test is printed; all output is in
//! target/test-logs.

mod checks;
mod host;
mod monitored;
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
    /// Run sampling tests in full: exhaustive power cuts, long random runs
    #[arg(long)]
    thorough: bool,
}

/// Runs all checks, or those that the flags select.
pub(crate) fn run(flags: &Flags) -> Result<()> {
    let needs = if flags.thorough { setup::THOROUGH } else { setup::TEST };
    setup::check(needs)?;
    let report = Report::new(flags.only.as_deref())?;
    report.build([builds_for_host(), builds_for_target(needs, flags.thorough)])?;
    let tests = suite::collect(flags.thorough, report.only())?;
    monitored::begin();
    let result = report.run([checks_for_host(), checks_for_target()], tests);
    monitored::print();
    result?;
    report.finish()
}
