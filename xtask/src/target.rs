//! The toolchain for the embedded target: the compiler that builds the images on this machine.
//!
//! An installed target comes first. Where rustup must not download (`RUSTUP_AUTO_INSTALL=0`) Debian's packages
//! build the core library from its source. Everywhere else rustup adds the target.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};
use start::target::{has_target, is_closed, linker, missing};

pub(crate) use start::target::TRIPLE;

use crate::apt;
use crate::command::{cargo, root, run};

/// Makes the compiler note the stack use of each function, in a section that is not flashed; `cargo xtask stack` adds
/// it up. A stable compiler accepts the flag only with `RUSTC_BOOTSTRAP`.
const STACK_SIZES: &str = "target.thumbv7em-none-eabihf.rustflags = ['-Zemit-stack-sizes']";

/// A toolchain that can build for [`TRIPLE`].
pub(crate) enum Toolchain {
    /// The cargo that has started xtask has the target.
    Installed,
    /// Debian's compiler with the source of its core library.
    Debian {
        /// A linker for the target.
        linker: PathBuf,
    },
}

impl Toolchain {
    /// Finds a toolchain or installs one. The error names the command to type.
    pub(crate) fn ensure() -> Result<Toolchain> {
        if has_target() {
            return Ok(Toolchain::Installed);
        }
        if is_closed() {
            apt::install(&missing())?;
            let linker = linker().with_context(|| {
                format!("no linker for {TRIPLE}: neither rustup's rust-lld nor Debian's lld-22 is there")
            })?;
            return Ok(Toolchain::Debian { linker });
        }
        eprintln!("adding the Rust target {TRIPLE}");
        run(Command::new("rustup").args(["target", "add", TRIPLE]).current_dir(root())).with_context(
            || format!("the Rust target {TRIPLE} is missing; with rustup: rustup target add {TRIPLE}"),
        )?;
        Ok(Toolchain::Installed)
    }

    /// A cargo call for the target, `cargo <verb> --target ... <args>`.
    ///
    /// The images do not depend on build settings of the environment. Incremental code is 2 % longer, which is more
    /// than the flash has left, and flags of the environment would replace those of `.cargo/config.toml`.
    pub(crate) fn cargo(&self, verb: &str, args: &[&str]) -> Command {
        let mut command = self.cargo_for(TRIPLE, verb, args);
        command.args(["--config", STACK_SIZES]);
        command
    }

    /// As [`cargo`](Toolchain::cargo), for another target of the same linker.
    pub(crate) fn cargo_for(&self, triple: &str, verb: &str, args: &[&str]) -> Command {
        let mut command = match self {
            Toolchain::Installed => cargo(),
            Toolchain::Debian { .. } => Command::new("/usr/bin/cargo"),
        };
        command.current_dir(root()).arg(verb).args(["--target", triple]).args(args);
        command.env("RUSTC_BOOTSTRAP", "1").env("CARGO_INCREMENTAL", "0");
        command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        if let Toolchain::Debian { linker } = self {
            command
                .arg("-Zbuild-std=core")
                .env("RUSTC", "/usr/bin/rustc")
                .env("RUSTDOC", "/usr/bin/rustdoc")
                .env("PATH", debian_first())
                .env(linker_variable(triple), linker)
                .env_remove("RUSTUP_TOOLCHAIN")
                .env_remove("CARGO");
        }
        command
    }
}

/// The variable with which cargo takes a linker for a target.
fn linker_variable(triple: &str) -> String {
    format!("CARGO_TARGET_{}_LINKER", triple.to_uppercase().replace('-', "_"))
}

/// Debian's cargo must find Debian's clippy-driver before rustup's proxies.
fn debian_first() -> std::ffi::OsString {
    let mut path = std::ffi::OsString::from("/usr/bin:");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    path
}
