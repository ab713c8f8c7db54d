//! Safe replacement of files: the old file stays until the new one is complete.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::Failure;

/// The most links from one to the other that are followed.
const LINKS: usize = 40;

/// A file that is written under a temporary name beside its final path, and is renamed when it is complete. An existing
/// file stays until then, and the new one has its permissions. A link stays; the file that it names is replaced. A device
/// or a named pipe is no file to replace, and is written directly.
pub(super) struct Replacement {
    path: PathBuf,
    part: Option<Part>,
    file: BufWriter<File>,
}

/// The temporary file. It is removed unless it is moved.
struct Part {
    path: PathBuf,
    to: PathBuf,
    is_moved: bool,
}

impl Replacement {
    /// Opens the file. A path that cannot be written fails here.
    pub(super) fn open(path: &Path) -> Result<Replacement, Failure> {
        let (part, file) = match fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(Failure::file(path, "it is a directory")),
            Ok(found) if !found.is_file() || is_descriptor(path) => {
                OpenOptions::new().append(true).open(path).map(|file| (None, file))
            }
            Ok(found) => Part::create(path, Some(found.permissions())),
            Err(_) => Part::create(path, None),
        }
        .map_err(|error| Failure::file(path, error))?;
        Ok(Replacement { path: path.to_owned(), part, file: BufWriter::new(file) })
    }

    /// Finishes the file and moves it to its final path.
    pub(super) fn complete(mut self) -> Result<(), Failure> {
        let finished = self.file.flush().and_then(|()| self.part.as_mut().map_or(Ok(()), Part::complete));
        finished.map_err(|error| Failure::file(&self.path, error))
    }

    /// Writes a whole file at once.
    pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let mut file = Replacement::open(path)?;
        file.write_all(bytes).map_err(|error| Failure::file(path, error))?;
        file.complete()
    }
}

/// Refuses a path beside which no other files can be written: that of a device or a named pipe.
pub(super) fn check_is_file(path: &Path) -> Result<(), Failure> {
    match fs::metadata(path) {
        Ok(found) if !found.is_file() => Err(Failure::file(path, "it is not a regular file")),
        _ => Ok(()),
    }
}

/// Whether a path names an open file of this process, such as its standard output.
fn is_descriptor(path: &Path) -> bool {
    let folders = ["/dev/fd", "/proc/self/fd", "/dev/stdout", "/dev/stderr"];
    folders.into_iter().any(|folder| path.starts_with(folder))
}

/// The path behind links. The last link may name a file that does not exist yet.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        let Ok(target) = fs::read_link(&path) else { return Ok(path) };
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    Err(io::Error::new(ErrorKind::InvalidInput, "its links have no end"))
}

impl Part {
    /// Creates the temporary file for a path, with the permissions of the old file.
    fn create(path: &Path, permissions: Option<Permissions>) -> io::Result<(Option<Part>, File)> {
        let to = behind_links(path)?;
        let mut name = to.file_name().map(ToOwned::to_owned).unwrap_or_default();
        name.push(".part");
        let path = to.with_file_name(name);
        // Whatever has the name of the temporary file, a link among others, is not written to.
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => (),
        }
        let file = File::create_new(&path)?;
        let part = Part { path, to, is_moved: false };
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok((Some(part), file))
    }

    fn complete(&mut self) -> io::Result<()> {
        fs::rename(&self.path, &self.to)?;
        self.is_moved = true;
        Ok(())
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

impl Drop for Part {
    /// Removes an incomplete file.
    fn drop(&mut self) {
        if !self.is_moved {
            let _ = fs::remove_file(&self.path);
        }
    }
}
