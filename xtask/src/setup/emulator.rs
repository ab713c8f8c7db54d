//! The build tools of the emulator: libclang, and a compiled CPU library or the cmake that compiles it.
//!
//! Each tool is looked for in the way of the build itself. Missing tools come from PyPI into the build directory,
//! without root.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Result, anyhow};

use start::{Need, Package, runs};

use super::{cpu_library, libclang, packages_in, python};
use crate::apt;
use crate::command::{cargo, target_dir};

/// A cargo call that can build the emulator.
pub(crate) fn cargo_with_emulator() -> Result<Command> {
    let mut command = cargo();
    command.envs(environment()?.iter().cloned());
    Ok(command)
}

/// The environment variables by which the build finds its tools. Missing tools are installed.
///
/// # Errors
/// A tool can neither come from PyPI nor be installed by this user with the package manager.
pub(crate) fn environment() -> Result<&'static [(OsString, OsString)]> {
    static ENVIRONMENT: OnceLock<Result<Vec<(OsString, OsString)>, String>> = OnceLock::new();
    let made = ENVIRONMENT.get_or_init(|| make().map_err(|error| format!("{error:#}")));
    made.as_deref().map_err(|error| anyhow!("{error}"))
}

/// The missing packages that only the package manager can install, beyond those that the first step knows.
pub(super) fn missing() -> Vec<Package> {
    let needs_python = find().is_none() && !start::python::makes_environments();
    if needs_python { vec![Package::Python] } else { Vec::new() }
}

fn make() -> Result<Vec<(OsString, OsString)>> {
    super::install(&[Need::Emulator])?;
    cpu_library::install();
    if let Some(found) = find() {
        return Ok(found);
    }
    eprintln!("getting cmake and libclang from PyPI, into {}", from_pypi().display());
    if let Err(error) = python::ensure(&from_pypi(), "xtask/build-tools.txt") {
        eprintln!("that failed: {error:#}");
    }
    if let Some(found) = find() {
        return Ok(found);
    }
    apt::install(&from_package_manager())?;
    find().ok_or_else(|| anyhow!("cmake or libclang does not work here, although it is installed; LIBCLANG_PATH can name the directory of another libclang"))
}

/// The system's tools where they work, else the tools from PyPI of an earlier run. A compiled CPU library needs no
/// cmake.
fn find() -> Option<Vec<(OsString, OsString)>> {
    let tools = from_pypi();
    let path = match cpu_library::variable() {
        Some(library) => Some(library),
        None => cmake(&tools)?,
    };
    let libclang = libclang::variables(None)
        .or_else(|| libclang::variables(Some(&packages_in(&tools)?.join("clang/native"))))?;
    let libclang = libclang.into_iter().map(|(name, value)| (name.into(), value.into()));
    Some(path.into_iter().chain(libclang).collect())
}

/// The variable with the search path to cmake; `Some(None)` where the user's own path leads to cmake.
#[allow(clippy::option_option, reason = "a cmake may be there and need no path")]
fn cmake(tools: &Path) -> Option<Option<(OsString, OsString)>> {
    if runs("cmake") {
        return Some(None);
    }
    let programs = tools.join("bin");
    if !runs(&programs.join("cmake").to_string_lossy()) {
        return None;
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::iter::once(programs).chain(std::env::split_paths(&path));
    Some(Some(("PATH".into(), std::env::join_paths(path).ok()?)))
}

fn from_package_manager() -> Vec<Package> {
    let mut packages = Vec::new();
    if !runs("cmake") {
        packages.push(Package::Cmake);
    }
    if libclang::variables(None).is_none() {
        packages.push(Package::Libclang);
    }
    packages
}

fn from_pypi() -> PathBuf {
    target_dir().join("build-tools")
}
