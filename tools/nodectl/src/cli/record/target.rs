//! The destination of a table.

use std::io::{self, Write};

use crate::cli::Failure;
use crate::cli::replacement::Replacement;

/// A file, or the standard output.
pub(super) enum Target {
    File(Replacement),
    Standard(io::Stdout),
}

impl Target {
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
