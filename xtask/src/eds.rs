//! `cargo xtask eds`: the files that are generated from the dictionary tables.

use anyhow::Result;

use crate::command::{cargo, run};

/// Writes the data sheets, the reference page and the data sheet of the product.
pub(crate) fn write() -> Result<()> {
    run(cargo().args(["run", "--quiet", "--profile", "sim", "-p", "eds", "--bin", "generate"]))
}
