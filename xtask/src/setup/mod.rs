//! The needs of a command beyond Rust. Each need is found on the machine, or installed without root where that is
//! possible, or named in an error.
//!
//! A command first calls [`check`] with all its needs. The check takes no time and changes nothing. If something can
//! only be installed by the system's package manager, and this user may not run it, the error contains the one command
//! that installs everything. After the check each need is installed where it is used.

mod cpu_library;
pub(crate) mod emulator;
mod libclang;
pub(crate) mod python;
pub(crate) use std::path::{Path, PathBuf};

use anyhow::Result;
use start::Package;

pub(crate) use libclang::probe;
pub(crate) use start::needs::{FLASH, IMAGES, Need, PICTURES, SIM, TEST, THOROUGH};

use crate::{apt, target};

/// Fails with the one command that installs the missing packages, if this user cannot install them.
pub(crate) fn check(needs: &[Need]) -> Result<()> {
    Ok(start::check(&missing(needs))?)
}

/// The missing packages that only the package manager can install. They include libclang, which only xtask can check.
fn missing(needs: &[Need]) -> Vec<Package> {
    let known = start::missing(needs);
    let mut packages = known.clone();
    if needs.contains(&Need::Emulator) {
        packages.extend(emulator::missing().into_iter().filter(|package| !known.contains(package)));
    }
    packages
}

/// Installs the missing packages with the package manager.
pub(crate) fn install(needs: &[Need]) -> Result<()> {
    apt::install(&missing(needs))
}

/// `cargo xtask setup`: installs everything that the test command needs, or only prints what is missing.
pub(crate) fn run(dry: bool) -> Result<()> {
    if dry {
        println!("{}", start::describe(&missing(TEST)));
        return Ok(());
    }
    install(TEST)?;
    target::Toolchain::ensure()?;
    emulator::environment()?;
    python::clients()?;
    println!("everything is there");
    Ok(())
}

/// The directory of an environment's packages, whose parent is named after the version of Python.
fn packages_in(environment: &Path) -> Option<PathBuf> {
    let versions = environment.join("lib").read_dir().ok()?;
    versions.flatten().map(|version| version.path().join("site-packages")).find(|path| path.is_dir())
}
