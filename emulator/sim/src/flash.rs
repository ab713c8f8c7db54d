//! Files for the memory that boards keep without power, from one run to the next: the flash and the backup SRAM.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use chip::Variant;

/// Size of the backup SRAM in bytes.
const BACKUP_SIZE: usize = 4 * 1024;

/// The flash file of a node.
pub fn file(dir: &Path, node: u8) -> PathBuf {
    dir.join(format!("node-{node}.flash"))
}

fn backup_file(dir: &Path, node: u8) -> PathBuf {
    dir.join(format!("node-{node}.backup"))
}

/// The kept content of a board's flash; `None` without a file.
pub fn load(dir: &Path, node: u8, chip: Variant) -> Result<Option<Vec<u8>>> {
    read(&file(dir, node), chip.flash_size() as usize)
}

/// The kept content of a board's backup SRAM; `None` without a file.
pub(crate) fn load_backup(dir: &Path, node: u8) -> Result<Option<Vec<u8>>> {
    read(&backup_file(dir, node), BACKUP_SIZE)
}

/// Writes the content of a board's flash. A reader sees either the old or the new content, never a mixture.
pub fn save(dir: &Path, node: u8, bytes: &[u8]) -> Result<()> {
    write(dir, &file(dir, node), bytes)
}

/// Writes the content of a board's backup SRAM; `None` removes the file.
pub(crate) fn save_backup(dir: &Path, node: u8, bytes: Option<&[u8]>) -> Result<()> {
    let path = backup_file(dir, node);
    match bytes {
        Some(bytes) => write(dir, &path, bytes),
        None => match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(error).with_context(|| format!("cannot remove {}", path.display()))
            }
            _ => Ok(()),
        },
    }
}

fn read(path: &Path, size: usize) -> Result<Option<Vec<u8>>> {
    let bytes = match wire::input::read(path, size as u64) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        bytes => bytes.with_context(|| format!("cannot read {}", path.display()))?,
    };
    ensure!(bytes.len() == size, "{} has {} bytes; it must have {size}", path.display(), bytes.len());
    Ok(Some(bytes))
}

fn write(dir: &Path, path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = path.with_extension("new");
    let write = || {
        fs::create_dir_all(dir)?;
        // Whatever has the name of the temporary file, a named pipe or a link among others, is not written to.
        match fs::remove_file(&temporary) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = fs::File::create_new(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHIP: Variant = Variant::F446;
    const SIZE: usize = CHIP.flash_size() as usize;

    /// An empty directory for this test.
    fn dir(test: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("sim-flash-{test}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        dir
    }

    #[test]
    fn saved_flash_is_loaded_for_its_own_node() {
        let dir = dir("roundtrip");
        assert_eq!(load(&dir, 5, CHIP).unwrap(), None);
        save(&dir, 5, &vec![0xA5; SIZE]).unwrap();
        save(&dir, 5, &vec![0x5A; SIZE]).unwrap();
        assert_eq!(load(&dir, 5, CHIP).unwrap(), Some(vec![0x5A; SIZE]));
        assert_eq!(load(&dir, 6, CHIP).unwrap(), None);
        assert_eq!(fs::read_dir(&dir).unwrap().count(), 1, "no temporary file is left");
        fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn an_empty_battery_leaves_no_file() {
        let dir = dir("backup");
        save_backup(&dir, 5, None).unwrap();
        save_backup(&dir, 5, Some(&[7; BACKUP_SIZE])).unwrap();
        assert_eq!(load_backup(&dir, 5).unwrap(), Some(vec![7; BACKUP_SIZE]));
        assert_eq!(load(&dir, 5, CHIP).unwrap(), None, "it is not the flash");
        save_backup(&dir, 5, None).unwrap();
        assert_eq!(load_backup(&dir, 5).unwrap(), None);
        fs::remove_dir_all(dir).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_named_pipe_or_a_device_is_an_error_of_one_line_and_is_not_written_to() {
        let dir = dir("kinds");
        fs::create_dir_all(&dir).unwrap();
        let pipe = |path: PathBuf| {
            assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
        };
        pipe(file(&dir, 1));
        std::os::unix::fs::symlink("/dev/zero", file(&dir, 2)).unwrap();
        let huge = fs::File::create(file(&dir, 3)).unwrap();
        huge.set_len(8 << 30).unwrap();
        for (node, words) in
            [(1, "not a regular file"), (2, "not a regular file"), (3, "larger than 524288 bytes")]
        {
            let error = format!("{:#}", load(&dir, node, CHIP).unwrap_err());
            let named = error.contains(&format!("node-{node}.flash")) && error.contains(words);
            assert!(named && !error.contains('\n'), "{error}");
        }
        pipe(dir.join("node-4.new"));
        std::os::unix::fs::symlink(dir.join("elsewhere"), dir.join("node-5.new")).unwrap();
        for node in [4, 5] {
            save(&dir, node, &vec![1; SIZE]).unwrap();
            assert_eq!(load(&dir, node, CHIP).unwrap(), Some(vec![1; SIZE]));
        }
        assert!(!dir.join("elsewhere").exists());
        fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn a_file_that_is_no_flash_is_an_error_of_one_line() {
        let dir = dir("refused");
        save(&dir, 1, &[0; 3]).unwrap();
        let error = format!("{:#}", load(&dir, 1, CHIP).unwrap_err());
        assert!(error.contains("node-1.flash has 3 bytes") && !error.contains('\n'), "{error}");
        fs::create_dir_all(file(&dir, 2)).unwrap();
        assert!(format!("{:#}", load(&dir, 2, CHIP).unwrap_err()).contains("node-2.flash"));
        assert!(save(&file(&dir, 1), 1, &[]).is_err(), "a file is no directory");
        fs::remove_dir_all(dir).unwrap();
    }
}
