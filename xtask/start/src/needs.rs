//! The needs of the commands, and the packages that are missing.

use crate::packages::{Package, runs};
use crate::{python, target};

/// A need of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A C compiler, cmake and libclang, which build the emulator's CPU library.
    Emulator,
    /// A compiler for the Cortex-M4.
    Target,
    /// The lints of the compiler for the Cortex-M4.
    TargetLints,
    /// A Python that can make environments, in which python-can and canopen run to test the node.
    Python,
    /// The tool that writes the flash of a board.
    Probe,
    /// The protocol analyser that checks the traffic on the bus.
    Tshark,
    /// The browser that shows the page, and the program that drives the browser.
    Browser,
    /// Another emulator of the core.
    Qemu,
}

/// The needs of `cargo sim`.
pub const SIM: &[Need] = &[Need::Target, Need::Emulator];

/// The needs of the images.
pub const IMAGES: &[Need] = &[Need::Target];

/// The needs of `cargo xtask flash`.
pub const FLASH: &[Need] = &[Need::Target, Need::Probe];

/// The needs of `cargo xtask test`.
pub const TEST: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser];

/// The needs of `cargo xtask test --thorough`.
pub const THOROUGH: &[Need] =
    &[Need::Target, Need::TargetLints, Need::Emulator, Need::Python, Need::Tshark, Need::Browser, Need::Qemu];

/// The needs of `cargo xtask pictures`.
pub const PICTURES: &[Need] = &[Need::Target, Need::Emulator, Need::Python, Need::Browser];

/// The missing packages that only the package manager can install.
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

/// The packages for the CPU library. Xtask checks libclang later, with the library that the build uses; a missing
/// libclang comes from PyPI.
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
