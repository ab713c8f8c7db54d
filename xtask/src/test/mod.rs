//! `cargo xtask test`: every check of the project.
//!
//! Two lanes at a time compile and lint, one for this machine and one for the Cortex-M4. Then all tests run, as many at a time as
//! there are cores, each in a process of its own. A step or a test that fails has its output printed; the output of all
//! is in target/test-logs.

mod checks;
mod host;
mod report;
mod suite;

use anyhow::Result;
use clap::Args;

use crate::setup;
use checks::{lane_of_host, lane_of_images};
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
    setup::check(setup::TEST)?;
    let report = Report::new(flags.only.as_deref())?;
    report.lanes(lane_of_host(), lane_of_images())?;
    let tests = suite::collect(flags.thorough, report.only())?;
    report.pool("tests", tests)?;
    report.finish()
}
