//! `cargo xtask timing`: the execution time of each task, and the response-time analysis.

use anyhow::Result;

use crate::command::run;
use crate::images;
use crate::own_tool::Tools;
use crate::setup::emulator;

/// Prints the table of the test that measures the times.
pub(crate) fn print() -> Result<()> {
    images::build(Tools::ByCargo)?;
    run(emulator::cargo_with_emulator()?
        .args([
            "test",
            "--quiet",
            "-p",
            "host-tests",
            "--profile",
            "sim",
            "--features",
            "board",
            "--test",
            "board",
        ])
        .args(["--", "--nocapture", "timing::"])
        .env("NODE_IMAGES", images::dir()))
}
