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

/// The variable by which the build finds the library. `None` where the library has to be compiled: pkg-config is
/// missing, or PyPI has no library for this machine or cannot be reached.
pub(super) fn variable() -> Option<(OsString, OsString)> {
    if !runs("pkg-config") {
        return None;
    }
    let environment = target_dir().join("cpu-library");
    let failed = environment.with_extension("missing");
    if failed.exists() {
        return None;
    }
    match described(&environment) {
        Ok(directory) => Some((SEARCH_PATH.into(), search_path(directory))),
        Err(error) => {
            eprintln!("PyPI has no compiled CPU library for this machine, so it is compiled here: {error:#}");
            // A second attempt would cost each later command its time; deleting the file allows one.
            let _ = std::fs::write(failed, format!("{error:#}\n"));
            None
        }
    }
}

/// Installs the wheel and describes its library. Returns the directory of the description.
fn described(environment: &Path) -> Result<PathBuf> {
    if !environment.exists() {
        eprintln!("installing the compiled CPU library from PyPI into {}", environment.display());
    }
    python::ensure(environment, LIST)?;
    let package = super::packages_in(environment).context("the environment has no packages")?.join("unicorn");
    let library = package.join("lib");
    ensure!(library.join("libunicorn.a").is_file(), "the wheel has no static library");
    let text = format!(
        "Name: unicorn\nDescription: CPU emulator\nVersion: 2.1.4\nLibs: -L{} -lunicorn\nCflags: -I{}\n",
        library.display(),
        package.join("include").display()
    );
    let description = environment.join("unicorn.pc");
    if std::fs::read_to_string(&description).ok().as_deref() != Some(&text) {
        std::fs::write(&description, text)?;
    }
    Ok(environment.to_owned())
}

/// The user's search path comes first.
fn search_path(directory: PathBuf) -> OsString {
    let own = std::env::var_os(SEARCH_PATH).unwrap_or_default();
    let own = std::env::split_paths(&own).filter(|path| !path.as_os_str().is_empty());
    let path: Vec<_> = own.chain([directory]).collect();
    std::env::join_paths(path).unwrap_or_default()
}
