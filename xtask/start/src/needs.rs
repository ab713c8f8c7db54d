//! What the commands need of the machine, and what is missing of it.

use crate::packages::{Package, runs};
use crate::{python, target};

/// A need of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
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
pub const SIM: &[Need] = &[Need::Target, Need::Emulator];

/// What the images need.
pub const IMAGES: &[Need] = &[Need::Target];

/// What `cargo xtask flash` needs.
pub const FLASH: &[Need] = &[Need::Target, Need::Probe];

/// What `cargo xtask test` needs.
pub const TEST: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser];

/// What `cargo xtask test --thorough` needs.
pub const THOROUGH: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser, Need::Qemu];

/// What `cargo xtask pictures` needs.
pub const PICTURES: &[Need] = &[Need::Target, Need::Emulator, Need::Python, Need::Browser];

/// What only the system's package manager can bring.
pub fn missing(needs: &[Need]) -> Vec<Package> {
    let mut packages: Vec<Package> = Vec::new();
    for need in needs {
        let of_need = match need {
            Need::Emulator => emulator(),
            Need::Target => target::missing(),
            Need::TargetLints => target::missing_lints(),
            Need::Python => python::missing(),
            Need::Probe => package_unless(runs("probe-rs"), Package::ProbeRs),
            Need::Tshark => package_unless(runs("tshark"), Package::Tshark),
            Need::Browser => browser(),
            Need::Qemu => package_unless(runs("qemu-system-arm"), Package::Qemu),
        };
        for package in of_need {
            if !packages.contains(&package) {
                packages.push(package);
            }
        }
    }
    packages
}

/// For the CPU library. Whether there is a libclang that works is asked later, with the library that the build asks: without one it
/// comes from PyPI.
fn emulator() -> Vec<Package> {
    let compiler = package_unless(runs("cc") && runs("make"), Package::Compiler);
    let python = package_unless(runs("cmake") || python::makes_environments(), Package::Python);
    [compiler, python].concat()
}

fn package_unless(is_there: bool, package: Package) -> Vec<Package> {
    if is_there { Vec::new() } else { vec![package] }
}

fn browser() -> Vec<Package> {
    let programs = [("chromium", Package::Chromium), ("chromedriver", Package::Chromedriver)];
    programs.into_iter().filter(|(program, _)| !runs(program)).map(|(_, package)| package).collect()
}
