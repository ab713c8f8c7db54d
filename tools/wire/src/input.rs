//! Input files: regular files of bounded size. A named pipe would block the program, and a device such as `/dev/zero` has no
//! end.

use std::fs::File;
use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

/// Reads a regular file of at most `most` bytes. Links are followed.
///
/// # Errors
/// The file cannot be read, is no regular file, or is larger.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    // Opening a named pipe would wait for a writer, so the kind of the file is checked first.
    if !path.metadata()?.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {most} bytes")));
    }
    Ok(bytes)
}

/// Reads a regular file of text of at most `most` bytes, without the byte order mark that some editors begin with.
///
/// # Errors
/// As [`read`]; the file is no UTF-8.
pub fn read_to_string(path: &Path, most: u64) -> io::Result<String> {
    let text = String::from_utf8(read(path, most)?);
    let text = text.map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is no text (UTF-8)"))?;
    Ok(text.strip_prefix('\u{FEFF}').map(str::to_owned).unwrap_or(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(test: &str) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("input-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_file_up_to_the_limit_is_read_and_a_larger_one_refused() {
        let folder = folder("size");
        let path = folder.join("file");
        std::fs::write(&path, "12345678").unwrap();
        assert_eq!(read(&path, 8).unwrap(), b"12345678");
        assert_eq!(read_to_string(&path, 9).unwrap(), "12345678");
        assert_eq!(read(&path, 7).unwrap_err().to_string(), "it is larger than 7 bytes");
        assert_eq!(read(&folder.join("none"), 7).unwrap_err().kind(), ErrorKind::NotFound);
        assert!(read(&folder, 7).is_err(), "a directory");
        std::fs::write(&path, [0xFF]).unwrap();
        assert!(read_to_string(&path, 9).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_byte_order_mark_is_no_text() {
        let folder = folder("mark");
        let path = folder.join("file");
        std::fs::write(&path, "\u{FEFF}time,value\n").unwrap();
        assert_eq!(read_to_string(&path, 99).unwrap(), "time,value\n");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_named_pipe_and_a_device_are_refused_at_once() {
        let folder = folder("kind");
        let (pipe, link) = (folder.join("pipe"), folder.join("link"));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        for path in [&pipe, &link] {
            assert_eq!(read(path, 7).unwrap_err().to_string(), "it is not a regular file");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
