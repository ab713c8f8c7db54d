//! Files that replace others: nothing is lost before the new one is complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::Failure;

/// A file that is written beside the place where it belongs, and goes there when it is complete. A file that is there
/// already stays until then.
pub(super) struct Replacement {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    is_complete: bool,
}

impl Replacement {
    /// Opens it. What cannot be written is told now.
    pub(super) fn open(path: &Path) -> Result<Replacement, Failure> {
        if path.is_dir() {
            return Err(Failure::file(path, "it is a directory"));
        }
        let mut name = path.file_name().map(ToOwned::to_owned).unwrap_or_default();
        name.push(".part");
        let part = path.with_file_name(name);
        let file = File::create(&part).map_err(|error| Failure::file(path, error))?;
        Ok(Replacement { path: path.to_owned(), part, file: BufWriter::new(file), is_complete: false })
    }

    /// The file is complete: it takes its place.
    pub(super) fn complete(mut self) -> Result<(), Failure> {
        let moved = self.file.flush().and_then(|()| fs::rename(&self.part, &self.path));
        self.is_complete = moved.is_ok();
        moved.map_err(|error| Failure::file(&self.path, error))
    }

    /// Writes all of a file at once.
    pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let mut file = Replacement::open(path)?;
        file.write_all(bytes).map_err(|error| Failure::file(path, error))?;
        file.complete()
    }
}

impl Write for Replacement {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Replacement {
    /// What has not become complete is of no use.
    fn drop(&mut self) {
        if !self.is_complete {
            let _ = fs::remove_file(&self.part);
        }
    }
}
