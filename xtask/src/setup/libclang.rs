//! Checks that bindgen will find a working libclang, with the library that bindgen itself uses.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, anyhow, ensure};
use clang::diagnostic::Severity;
use clang::{Clang, Index, Unsaved};

use start::output;

/// The variable with the directory in which bindgen looks for libclang.
pub(super) const LIBRARY: &str = "LIBCLANG_PATH";
/// The variable with further arguments of bindgen to libclang.
pub(super) const ARGUMENTS: &str = "BINDGEN_EXTRA_CLANG_ARGS";

/// A header that includes headers of the compiler and of the C library, as the headers of the CPU library do.
const HEADER: &str = "#include <stdarg.h>\n#include <stdbool.h>\n#include <stdint.h>\n#include <stdlib.h>\n";

/// Loads libclang and reads a header, in the same way as bindgen.
///
/// # Errors
/// No library can be loaded, or a header is missing.
pub(crate) fn probe() -> Result<()> {
    let clang = Clang::new().map_err(|reason| anyhow!("{reason}"))?;
    let index = Index::new(&clang, false, false);
    let arguments = std::env::var(ARGUMENTS).unwrap_or_default();
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    let mut parser = index.parser("probe.h");
    let unit = parser.arguments(&arguments).unsaved(&[Unsaved::new("probe.h", HEADER)]).parse()?;
    let mut wrong = unit.get_diagnostics();
    wrong.retain(|diagnostic| diagnostic.get_severity() >= Severity::Error);
    ensure!(
        wrong.is_empty(),
        "{}",
        wrong.first().map(clang::diagnostic::Diagnostic::get_text).unwrap_or_default()
    );
    Ok(())
}

/// The variables with which the probe succeeds, tried from none to all: a libclang of this directory instead of the
/// system's, and the headers of the C compiler, which a libclang from PyPI lacks. The probe runs in a process of its
/// own, because a broken library ends the process that loads it.
pub(super) fn variables(directory: Option<&Path>) -> Option<Vec<(&'static str, String)>> {
    let library = directory.map(|directory| (LIBRARY, directory.display().to_string()));
    let headers = headers_of_compiler().map(|headers| (ARGUMENTS, headers));
    let without: Vec<_> = library.into_iter().collect();
    let with: Vec<_> = without.iter().cloned().chain(headers).collect();
    [without, with].into_iter().find(|variables| succeeds(variables).unwrap_or(false))
}

fn succeeds(variables: &[(&str, String)]) -> Result<bool> {
    let program = std::env::current_exe().context("this program has no path")?;
    let mut command = Command::new(program);
    command.arg("probe-libclang").envs(variables.iter().map(|(name, value)| (*name, value)));
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    Ok(status?.success())
}

/// The argument that adds the headers of the C compiler (`stdbool.h` and the like), after those of the user.
fn headers_of_compiler() -> Option<String> {
    let include = output("cc", &["-print-file-name=include"])?;
    let own = std::env::var(ARGUMENTS).unwrap_or_default();
    Path::new(&include).is_dir().then(|| format!("{own} -isystem {include}").trim_start().to_owned())
}
