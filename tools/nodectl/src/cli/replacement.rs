//! Safe replacement of files: the old file stays until the new one is complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::Failure;

/// A file that is written under a temporary name beside its final path, and is renamed when it is complete. An existing
/// file stays until then.
pub(super) struct Replacement {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    is_complete: bool,
}

impl Replacement {
    /// Opens the file. A path that cannot be written fails here.
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

    /// Finishes the file and moves it to its final path.
    pub(super) fn complete(mut self) -> Result<(), Failure> {
        let moved = self.file.flush().and_then(|()| fs::rename(&self.part, &self.path));
        self.is_complete = moved.is_ok();
        moved.map_err(|error| Failure::file(&self.path, error))
    }

    /// Writes a whole file at once.
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
    /// Removes an incomplete file.
    fn drop(&mut self) {
        if !self.is_complete {
            let _ = fs::remove_file(&self.part);
        }
    }
}
