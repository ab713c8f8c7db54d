//! The destination of a table.

use std::io::{self, Write};
use std::path::Path;

use crate::cli::Failure;
use crate::cli::replacement::Replacement;

/// A file, or the standard output.
pub(super) enum Target {
    File(Replacement),
    Standard(io::Stdout),
}

/// Whether a path stands for the standard output.
pub(super) fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

impl Target {
    /// Opens a file; "-" is the standard output.
    pub(super) fn open(path: &Path) -> Result<Target, Failure> {
        if is_standard(path) {
            return Ok(Target::Standard(io::stdout()));
        }
        Replacement::open(path).map(Target::File)
    }

    /// Finishes the file.
    pub(super) fn complete(self) -> Result<(), Failure> {
        match self {
            Target::File(file) => file.complete(),
            Target::Standard(_) => Ok(()),
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Target::File(file) => file.write(bytes),
            Target::Standard(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Target::File(file) => file.flush(),
            Target::Standard(out) => out.flush(),
        }
    }
}
