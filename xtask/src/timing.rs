//! `cargo xtask timing`: how long each task takes, and the response-time analysis.

use anyhow::Result;

use crate::command::{cargo, run};
use crate::images;

/// Prints the table of the test that measures it.
pub(crate) fn print() -> Result<()> {
    images::build()?;
    run(cargo()
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
