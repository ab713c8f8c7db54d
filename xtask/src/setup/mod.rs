//! What a command needs of the machine beyond Rust: found, brought without root where that is possible, else named.
//!
//! A command first calls [`check`] with all its needs. The check takes no time and changes nothing. When something can be
//! had from the system's package manager only, and this user may not install it, the error holds the one command that
//! installs everything that is missing. After that each need is brought where it is used.

pub(crate) mod emulator;
mod libclang;
pub(crate) mod python;
pub(crate) mod system;

use anyhow::Result;
use start::Package;

pub(crate) use libclang::probe;
pub(crate) use start::needs::{FLASH, IMAGES, Need, PICTURES, SIM, TEST, THOROUGH};

use crate::target;

/// Ends with the one command that installs what is missing, where this user cannot go on without it.
pub(crate) fn check(needs: &[Need]) -> Result<()> {
    Ok(start::check(&missing(needs))?)
}

/// What only the system's package manager can bring; with what is known of libclang only here.
fn missing(needs: &[Need]) -> Vec<Package> {
    let known = start::missing(needs);
    let mut packages = known.clone();
    if needs.contains(&Need::Emulator) {
        packages.extend(emulator::missing().into_iter().filter(|package| !known.contains(package)));
    }
    packages
}

/// Brings what the needs lack from the package manager.
pub(crate) fn install(needs: &[Need]) -> Result<()> {
    system::install(&missing(needs))
}

/// `cargo xtask setup`: brings everything that the test command needs, or only says what is missing.
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
