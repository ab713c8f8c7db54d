//! The emulator's CPU library, already compiled: the PyPI wheel contains the static library and its headers.
//!
//! The build script of `unicorn-engine-sys` asks pkg-config for the library, and compiles it with cmake where
//! pkg-config has none. A description of the library in the wheel therefore saves the compilation, two minutes of a core.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use start::runs;

use super::python;
use crate::command::target_dir;

/// The packages with the library, relative to the root of the project.
const LIST: &str = "xtask/cpu-library.txt";
/// The search path of pkg-config.
const SEARCH_PATH: &str = "PKG_CONFIG_PATH";
/// The description of the library for pkg-config, in the environment with the wheel. The build asks for version 2 at
/// least; the list names the version.
const DESCRIPTION: &str = "unicorn.pc";

/// The variable by which the build finds the library. `None` where the library has to be compiled. Installs nothing.
pub(super) fn variable() -> Option<(OsString, OsString)> {
    let environment = environment();
    let is_there = environment.join(DESCRIPTION).is_file() && runs("pkg-config");
    is_there.then(|| (SEARCH_PATH.into(), search_path(environment)))
}

/// Installs the wheel, if pkg-config is present. Where that fails, the library is compiled.
pub(super) fn install() {
    let failed = environment().with_extension("missing");
    if !runs("pkg-config") || failed.exists() {
        return;
    }
    if let Err(error) = describe(&environment()) {
        eprintln!(
            "the compiled CPU library cannot be installed from PyPI, so it is compiled here: {error:#}"
        );
        // A second attempt would cost each later command its time; deleting the file allows one.
        let _ = std::fs::write(failed, format!("{error:#}\n"));
    }
}

fn environment() -> PathBuf {
    target_dir().join("cpu-library")
}

/// Installs the wheel and describes the place of its library, which moves with the build directory.
fn describe(environment: &Path) -> Result<()> {
    if !environment.exists() {
        eprintln!("installing the compiled CPU library from PyPI into {}", environment.display());
    }
    python::ensure(environment, LIST)?;
    let package = super::packages_in(environment).context("the environment has no packages")?.join("unicorn");
    let library = package.join("lib");
    ensure!(library.join("libunicorn.a").is_file(), "the wheel has no static library");
    let text = format!(
        "Name: unicorn\nDescription: CPU emulator\nVersion: 2\nLibs: -L{} -lunicorn\nCflags: -I{}\n",
        library.display(),
        package.join("include").display()
    );
    std::fs::write(environment.join(DESCRIPTION), text).context("cannot describe the library")
}

/// The user's search path comes first.
fn search_path(directory: PathBuf) -> OsString {
    let own = std::env::var_os(SEARCH_PATH).unwrap_or_default();
    let own = std::env::split_paths(&own).filter(|path| !path.as_os_str().is_empty());
    let path: Vec<_> = own.chain([directory]).collect();
    std::env::join_paths(path).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    /// The headers of the wheel were compared with those of this version of the crate. Another version of either needs
    /// another comparison, and a new line in the list.
    #[test]
    fn the_wheel_belongs_to_the_locked_version_of_the_crate() {
        let lock = include_str!("../../../Cargo.lock");
        let (_, entry) =
            lock.split_once("name = \"unicorn-engine-sys\"\nversion = \"").expect("the crate is locked");
        let (version, _) = entry.split_once('"').expect("a version");
        let list = include_str!("../../cpu-library.txt");
        assert!(list.contains(&format!("unicorn-engine-sys {version}.")), "{version}: {list}");
    }
}
