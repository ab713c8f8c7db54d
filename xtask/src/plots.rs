//! `cargo xtask plots`: plots and tables of the measurement chain for its documentation.

use anyhow::Result;

use crate::command::{cargo, run};

/// Writes the plots and the tables.
pub(crate) fn write() -> Result<()> {
    run(cargo().args(["run", "--quiet", "-p", "profiles", "--example", "plots"]))
}
