//! The system's package manager: its kind, its names of packages, and whether this user may install them.

use std::error::Error;
use std::fmt;
use std::process::{Command, Stdio};

use crate::output;
use crate::target::{self, TRIPLE};

/// A package of the package manager, or a tool that is installed in another way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Package {
    /// A C compiler and make.
    Compiler,
    /// cmake, where it cannot be had from PyPI.
    Cmake,
    /// libclang with its headers, where it cannot be had from PyPI.
    Libclang,
    /// A Python that can make environments.
    Python,
    /// The protocol analyser.
    Tshark,
    /// The browser.
    Chromium,
    /// The program that drives the browser.
    Chromedriver,
    /// QEMU for Arm.
    Qemu,
    /// Debian's compiler for the Cortex-M4.
    DebianRust,
    /// Debian's source of the core library.
    DebianRustSource,
    /// Debian's cargo.
    DebianCargo,
    /// Debian's clippy.
    DebianClippy,
    /// Debian's linker, where rustup's linker is missing.
    DebianLinker,
    /// The tools that read coverage counters.
    DebianLlvm,
    /// The Rust target, where only the user may let rustup add it.
    RustTarget,
    /// probe-rs, which Debian does not have.
    ProbeRs,
}

/// A package manager.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Manager {
    Apt,
    Dnf,
    Pacman,
    Brew,
}

const MANAGERS: [(Manager, &str); 4] =
    [(Manager::Apt, "apt-get"), (Manager::Dnf, "dnf"), (Manager::Pacman, "pacman"), (Manager::Brew, "brew")];

impl Manager {
    fn find() -> Option<Manager> {
        MANAGERS.into_iter().find(|(_, program)| runs(program)).map(|(manager, _)| manager)
    }

    /// The command that installs these packages.
    fn command(self, packages: &[Package]) -> String {
        let start = match self {
            Manager::Apt => "sudo apt-get install -y",
            Manager::Dnf => "sudo dnf install -y",
            Manager::Pacman => "sudo pacman -S --needed --noconfirm",
            Manager::Brew => "brew install",
        };
        let names = self.names(packages).join(" ");
        let install = (!names.is_empty()).then(|| format!("{start} {names}"));
        install.into_iter().chain(own_commands(packages)).collect::<Vec<_>>().join(" && ")
    }

    fn names(self, packages: &[Package]) -> Vec<&'static str> {
        let from_here = packages.iter().filter(|package| package.own_command().is_none());
        let mut names: Vec<&str> = from_here.map(|package| self.name(*package)).collect();
        // Some package managers have the browser and its driver in one package.
        names.dedup();
        names
    }

    fn name(self, package: Package) -> &'static str {
        let [apt, dnf, pacman, brew] = package.names();
        match self {
            Manager::Apt => apt,
            Manager::Dnf => dnf,
            Manager::Pacman => pacman,
            Manager::Brew => brew,
        }
    }
}

impl Package {
    /// The names of a package for apt-get, dnf, pacman and brew.
    fn names(self) -> [&'static str; 4] {
        match self {
            Package::Compiler => ["build-essential", "gcc make", "base-devel", "gcc make"],
            Package::Cmake => ["cmake", "cmake", "cmake", "cmake"],
            Package::Libclang => ["libclang-dev", "clang-devel", "clang", "llvm"],
            Package::Python => ["python3-venv", "python3", "python", "python"],
            Package::Tshark => ["tshark", "wireshark-cli", "wireshark-cli", "wireshark"],
            Package::Chromium => ["chromium"; 4],
            Package::Qemu => ["qemu-system-arm", "qemu-system-arm", "qemu-system-arm", "qemu"],
            Package::Chromedriver => ["chromium-driver", "chromedriver", "chromium", "chromedriver"],
            // These packages are only needed where Debian builds for the target.
            Package::DebianRust => ["rustc-web"; 4],
            Package::DebianRustSource => ["rust-web-src"; 4],
            Package::DebianCargo => ["cargo-web"; 4],
            Package::DebianClippy => ["rust-web-clippy"; 4],
            Package::DebianLinker => ["lld-22"; 4],
            Package::DebianLlvm => ["llvm-22"; 4],
            Package::RustTarget => [TRIPLE; 4],
            Package::ProbeRs => ["probe-rs"; 4],
        }
    }

    /// The command that installs the package, where it is not the package manager.
    fn own_command(self) -> Option<String> {
        match self {
            Package::RustTarget => Some(add_target()),
            Package::ProbeRs => Some("cargo install --locked probe-rs-tools".to_owned()),
            _ => None,
        }
    }

    fn reason(self) -> &'static str {
        match self {
            Package::Compiler | Package::Cmake | Package::Libclang => {
                "the emulator's CPU library is built with it"
            }
            Package::Python => "cmake, libclang and the tests' CANopen clients come from PyPI",
            Package::Tshark => "the tests have it decode what was said on the bus",
            Package::Qemu => {
                "`cargo xtask test --thorough` asks it for a second opinion on the emulated core"
            }
            Package::Chromium | Package::Chromedriver => "the tests look at the page of the bus with it",
            Package::DebianRust
            | Package::DebianRustSource
            | Package::DebianCargo
            | Package::DebianClippy
            | Package::DebianLinker => {
                "it builds for the Cortex-M4, because RUSTUP_AUTO_INSTALL=0 keeps rustup from adding the target"
            }
            Package::DebianLlvm => "its llvm-cov reads the counters",
            Package::RustTarget => "the firmware is built for it, and rustup cannot add it from here",
            Package::ProbeRs => "it writes the flash of a board and reads its log (https://probe.rs)",
        }
    }
}

/// A missing package that this user cannot install. The text contains the command that installs it.
#[derive(Debug)]
pub struct Missing(String);

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for Missing {}

/// Checks that these packages can be installed without asking the user.
///
/// # Errors
/// This user cannot install them.
pub fn check(packages: &[Package]) -> Result<(), Missing> {
    let is_installable = may_install() && own_commands(packages).next().is_none();
    if packages.is_empty() || is_installable { Ok(()) } else { Err(Missing(describe(packages))) }
}

/// A text with the missing packages, the reason for each, and the command that installs them.
pub fn describe(packages: &[Package]) -> String {
    if packages.is_empty() {
        return "nothing is missing".to_owned();
    }
    let manager = Manager::find();
    let mut text = String::from("missing:\n");
    for package in packages {
        let name = manager.unwrap_or(Manager::Apt).name(*package);
        text += &format!("  {name}: {}\n", package.reason());
    }
    text + &match manager {
        Some(manager) => format!("run this, then try again:\n\n    {}\n", manager.command(packages)),
        None => own_commands(packages).fold(
            "install this with your system's package manager, then try again".to_owned(),
            |text, command| format!("{text}\n\n    {command}"),
        ),
    }
}

fn own_commands(packages: &[Package]) -> impl Iterator<Item = String> {
    packages.iter().filter_map(|package| package.own_command())
}

/// The command that adds the target, for a user whose rustup may not download by itself.
fn add_target() -> String {
    let closed = if target::is_closed() { "env -u RUSTUP_AUTO_INSTALL " } else { "" };
    format!("{closed}rustup target add {TRIPLE}")
}

/// Whether a program can be started and prints its version. Starting alone is no proof, because the names of some
/// programs lead to a stub that only offers to install them.
pub fn runs(program: &str) -> bool {
    let status = Command::new(program)
        .arg("--version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// Whether Debian's package manager has installed a package.
pub fn is_installed(package: Package) -> bool {
    output("dpkg-query", &["-W", "-f", "${Status}", Manager::Apt.name(package)])
        .is_some_and(|status| status.ends_with("ok installed"))
}

/// The names of packages for apt-get.
pub fn apt_names(packages: &[Package]) -> Vec<&'static str> {
    Manager::Apt.names(packages)
}

fn may_install() -> bool {
    Manager::find() == Some(Manager::Apt) && output("id", &["-u"]).as_deref() == Some("0")
}
