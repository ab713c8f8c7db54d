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

pub(crate) use libclang::probe;

use crate::target;
use system::Package;

/// A need of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Need {
    /// A C compiler, cmake and libclang: the emulator's CPU library is built with them.
    Emulator,
    /// A compiler for the Cortex-M4.
    Target,
    /// The lints of that compiler.
    TargetLints,
    /// A Python that makes environments: the outside judges python-can and canopen run in one.
    Python,
    /// The tool that writes the flash of a board.
    Probe,
    /// The protocol analyser that judges what was said on the bus.
    Tshark,
    /// The browser that shows the page of the bus, and the program that drives it.
    Browser,
    /// Another emulator of the core.
    Qemu,
}

/// What `cargo sim` needs.
pub(crate) const SIM: &[Need] = &[Need::Target, Need::Emulator];

/// What the images need.
pub(crate) const IMAGES: &[Need] = &[Need::Target];

/// What `cargo xtask flash` needs.
pub(crate) const FLASH: &[Need] = &[Need::Target, Need::Probe];

/// What `cargo xtask test` needs.
pub(crate) const TEST: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser];

/// What `cargo xtask test --thorough` needs.
pub(crate) const THOROUGH: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser, Need::Qemu];

/// What `cargo xtask pictures` needs.
pub(crate) const PICTURES: &[Need] = &[Need::Target, Need::Emulator, Need::Python, Need::Browser];

/// Ends with the one command that installs what is missing, where this user cannot go on without it.
pub(crate) fn check(needs: &[Need]) -> Result<()> {
    system::check(&missing(needs))
}

/// What only the system's package manager can bring.
fn missing(needs: &[Need]) -> Vec<Package> {
    let mut packages: Vec<Package> = Vec::new();
    for need in needs {
        let of_need = match need {
            Need::Emulator => emulator::missing(),
            Need::Target => target::missing(),
            Need::TargetLints => target::missing_lints(),
            Need::Python => python::missing(),
            Need::Probe => package_unless(system::runs("probe-rs"), Package::ProbeRs),
            Need::Tshark => package_unless(system::runs("tshark"), Package::Tshark),
            Need::Browser => browser(),
            Need::Qemu => package_unless(system::runs("qemu-system-arm"), Package::Qemu),
        };
        for package in of_need {
            if !packages.contains(&package) {
                packages.push(package);
            }
        }
    }
    packages
}

/// Brings what the needs lack from the package manager.
pub(crate) fn install(needs: &[Need]) -> Result<()> {
    system::install(&missing(needs))
}

fn package_unless(is_there: bool, package: Package) -> Vec<Package> {
    if is_there { Vec::new() } else { vec![package] }
}

fn browser() -> Vec<Package> {
    let programs = [("chromium", Package::Chromium), ("chromedriver", Package::Chromedriver)];
    programs.into_iter().filter(|(program, _)| !system::runs(program)).map(|(_, package)| package).collect()
}

/// `cargo xtask setup`: brings everything that the test command needs, or only says what is missing.
pub(crate) fn run(dry: bool) -> Result<()> {
    if dry {
        println!("{}", system::describe(&missing(TEST)));
        return Ok(());
    }
    install(TEST)?;
    target::Toolchain::ensure()?;
    emulator::environment()?;
    python::clients()?;
    println!("everything is there");
    Ok(())
}
