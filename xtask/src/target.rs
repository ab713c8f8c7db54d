//! The Rust of the embedded target: which compiler builds the images on this machine.
//!
//! An installed target comes first. Where rustup must not download (`RUSTUP_AUTO_INSTALL=0`) Debian's packages
//! build the core library from its source. Everywhere else rustup adds the target.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::command::{cargo, output, root, run};
use crate::setup::system::{self, Package, is_installed, runs};

/// The target of both images: Cortex-M4 with its FPU.
pub(crate) const TRIPLE: &str = "thumbv7em-none-eabihf";

/// Has the compiler note what each function takes of the stack, in a section that is not flashed; `cargo xtask stack` adds it
/// up. A stable compiler knows the flag with `RUSTC_BOOTSTRAP` only.
const STACK_SIZES: &str = "target.thumbv7em-none-eabihf.rustflags = ['-Zemit-stack-sizes']";

const DEBIAN: [Package; 3] = [Package::DebianRust, Package::DebianRustSource, Package::DebianCargo];

/// A toolchain that can build for [`TRIPLE`].
pub(crate) enum Toolchain {
    /// The cargo that runs us has the target.
    Installed,
    /// Debian's compiler with the source of its core library.
    Debian {
        /// A linker for the target.
        linker: PathBuf,
    },
}

impl Toolchain {
    /// Finds one, or installs it, or says what to type.
    pub(crate) fn ensure() -> Result<Toolchain> {
        if has_target() {
            return Ok(Toolchain::Installed);
        }
        if is_closed() {
            system::install(&missing())?;
            return Ok(Toolchain::Debian { linker: linker()? });
        }
        eprintln!("adding the Rust target {TRIPLE}");
        run(Command::new("rustup").args(["target", "add", TRIPLE]).current_dir(root())).with_context(
            || format!("the Rust target {TRIPLE} is missing; with rustup: rustup target add {TRIPLE}"),
        )?;
        Ok(Toolchain::Installed)
    }

    /// A cargo call for the target, `cargo <verb> --target ... <args>`.
    ///
    /// The images are the same whatever the surroundings say of builds: incremental code is 2 % longer, which is more than the flash has
    /// left, and flags of the surroundings replace those of `.cargo/config.toml`.
    pub(crate) fn cargo(&self, verb: &str, args: &[&str]) -> Command {
        let mut command = match self {
            Toolchain::Installed => cargo(),
            Toolchain::Debian { .. } => Command::new("/usr/bin/cargo"),
        };
        command.current_dir(root()).arg(verb).args(["--target", TRIPLE]).args(args);
        command.args(["--config", STACK_SIZES]).env("RUSTC_BOOTSTRAP", "1").env("CARGO_INCREMENTAL", "0");
        command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        if let Toolchain::Debian { linker } = self {
            command
                .arg("-Zbuild-std=core")
                .env("RUSTC", "/usr/bin/rustc")
                .env("RUSTDOC", "/usr/bin/rustdoc")
                .env("PATH", debian_first())
                .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker)
                .env_remove("RUSTUP_TOOLCHAIN")
                .env_remove("CARGO");
        }
        command
    }
}

/// Whether the compiler at hand has a core library for the target.
fn has_target() -> bool {
    let Some(libdir) = output("rustc", &["--print", "target-libdir", "--target", TRIPLE]) else {
        return false;
    };
    let Ok(entries) = Path::new(&libdir).read_dir() else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libcore"))
}

/// What only the package manager can bring for the target.
pub(crate) fn missing() -> Vec<Package> {
    if has_target() {
        return Vec::new();
    }
    if is_closed() && runs("apt-get") {
        let linker = linker().is_err().then_some(Package::DebianLinker);
        return DEBIAN.into_iter().filter(|package| !is_installed(*package)).chain(linker).collect();
    }
    if is_closed() || !runs("rustup") { vec![Package::RustTarget] } else { Vec::new() }
}

/// The same for clippy, which comes with the compiler unless Debian builds for the target.
pub(crate) fn missing_lints() -> Vec<Package> {
    let is_debian = !has_target() && is_closed() && runs("apt-get");
    if is_debian && !is_installed(Package::DebianClippy) { vec![Package::DebianClippy] } else { Vec::new() }
}

/// Whether rustup must not download.
pub(crate) fn is_closed() -> bool {
    std::env::var("RUSTUP_AUTO_INSTALL").is_ok_and(|value| value == "0")
}

/// rustup's own lld, else the one that Debian's package links to.
fn linker() -> Result<PathBuf> {
    let sysroot = output("rustc", &["--print", "sysroot"]).unwrap_or_default();
    let host = env!("XTASK_HOST");
    let bundled = Path::new(&sysroot).join("lib/rustlib").join(host).join("bin/rust-lld");
    let debian = PathBuf::from("/usr/lib/llvm-22/bin/ld.lld");
    match [bundled, debian].into_iter().find(|path| path.exists()) {
        Some(path) => Ok(path),
        None => bail!("no linker for {TRIPLE}: neither rustup's rust-lld nor Debian's lld-22 is there"),
    }
}

/// Debian's cargo must find Debian's clippy-driver before rustup's proxies.
fn debian_first() -> std::ffi::OsString {
    let mut path = std::ffi::OsString::from("/usr/bin:");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    path
}
