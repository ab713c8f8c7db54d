//! What the emulator's CPU library, a C program with cmake, needs to be built: a C compiler, make, cmake, libclang.
//!
//! The build finds these in its own way; so each is asked for as the build asks. What the machine does not have comes from
//! PyPI into the build directory, without root.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Result, anyhow};

use start::{Need, Package, runs};

use super::{libclang, python, system};
use crate::command::{cargo, target_dir};

/// A cargo call that can build the emulator.
pub(crate) fn cargo_with_emulator() -> Result<Command> {
    let mut command = cargo();
    command.envs(environment()?.iter().cloned());
    Ok(command)
}

/// The variables of the environment with which the build finds what it needs; brings what is missing.
///
/// # Errors
/// Something can be had neither from PyPI nor, by this user, from the package manager.
pub(crate) fn environment() -> Result<&'static [(OsString, OsString)]> {
    static ENVIRONMENT: OnceLock<Result<Vec<(OsString, OsString)>, String>> = OnceLock::new();
    let made = ENVIRONMENT.get_or_init(|| make().map_err(|error| format!("{error:#}")));
    made.as_deref().map_err(|error| anyhow!("{error}"))
}

/// What only the package manager can bring, beyond what is known before this program is compiled.
pub(super) fn missing() -> Vec<Package> {
    let needs_python = find().is_none() && !start::python::makes_environments();
    if needs_python { vec![Package::Python] } else { Vec::new() }
}

fn make() -> Result<Vec<(OsString, OsString)>> {
    super::install(&[Need::Emulator])?;
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
    system::install(&from_package_manager())?;
    find().ok_or_else(|| anyhow!("cmake or libclang does not work here, although it is installed; LIBCLANG_PATH can name the directory of another libclang"))
}

/// The system's tools where they work, else those that came from PyPI earlier.
fn find() -> Option<Vec<(OsString, OsString)>> {
    let tools = from_pypi();
    let path = cmake(&tools)?;
    let libclang = libclang::variables(None)
        .or_else(|| libclang::variables(Some(&packages_in(&tools)?.join("clang/native"))))?;
    let libclang = libclang.into_iter().map(|(name, value)| (name.into(), value.into()));
    Some(path.into_iter().chain(libclang).collect())
}

/// The search path on which cmake is found; `None` in it where the user's own path leads there.
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

/// Where an environment keeps its packages: below a directory named after the version of Python.
fn packages_in(environment: &Path) -> Option<PathBuf> {
    let versions = environment.join("lib").read_dir().ok()?;
    versions.flatten().map(|version| version.path().join("site-packages")).find(|path| path.is_dir())
}
