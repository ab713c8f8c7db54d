//! Files that a command writes where something else is already: a link, a named pipe, a file with permissions.

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::commands::{failed, printed};
use crate::pressure::Pressure;
use crate::wire::Wire;

/// An empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn dump(wire: &Wire<Pressure>, path: &Path) {
    printed(wire, &["dump", path.to_str().unwrap()]);
}

fn is_dcf(path: &Path) -> bool {
    fs::read_to_string(path).is_ok_and(|text| text.contains("[DeviceComissioning]"))
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn a_link_stays_and_its_file_is_written() {
    let (wire, folder) = (Wire::new(Pressure::new(1)), folder("links"));
    fs::create_dir(folder.join("real")).unwrap();
    fs::write(folder.join("real/old.dcf"), "old").unwrap();
    for (link, target) in [("old.dcf", "real/old.dcf"), ("chain.dcf", "old.dcf"), ("new.dcf", "real/new.dcf")]
    {
        symlink(target, folder.join(link)).unwrap();
        dump(&wire, &folder.join(link));
        assert!(folder.join(link).is_symlink(), "{link}");
        assert!(is_dcf(&folder.join(target)), "{link}");
    }
    assert_eq!(names(&folder), ["chain.dcf", "new.dcf", "old.dcf", "real"]);
    assert_eq!(names(&folder.join("real")), ["new.dcf", "old.dcf"]);
    symlink("loop.dcf", folder.join("loop.dcf")).unwrap();
    assert_eq!(failed(&wire, &["dump", folder.join("loop.dcf").to_str().unwrap()]).0, 7);
    assert!(folder.join("loop.dcf").is_symlink());
}

#[test]
fn a_file_keeps_its_permissions() {
    let (wire, folder) = (Wire::new(Pressure::new(1)), folder("modes"));
    let file = folder.join("secret.dcf");
    fs::write(&file, "old").unwrap();
    for mode in [0o600, 0o664] {
        fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
        dump(&wire, &file);
        assert!(is_dcf(&file));
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, mode);
    }
}

/// A named pipe stands for devices as well, which a test cannot make.
#[test]
fn a_named_pipe_is_written_through() {
    let (wire, folder) = (Wire::new(Pressure::new(1)), folder("pipes"));
    let (pipe, link) = (folder.join("pipe"), folder.join("link"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    symlink("pipe", &link).unwrap();
    for (path, line) in [
        (&pipe, &["dump"][..]),
        (&link, &["dump"]),
        (&pipe, &["read", "1018:4", "--out"]),
        (&pipe, &["record", "--start", "--for", "1", "--csv"]),
    ] {
        let reader = Command::new("cat").arg(&pipe).stdout(Stdio::piped()).spawn().unwrap();
        printed(&wire, &[line, &[path.to_str().unwrap()]].concat());
        let is_pipe = fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo();
        if !is_pipe {
            let _ = Command::new("kill").arg(reader.id().to_string()).status();
        }
        assert!(is_pipe, "{line:?}");
        assert!(!reader.wait_with_output().unwrap().stdout.is_empty(), "{line:?}");
    }
    assert_eq!(names(&folder), ["link", "pipe"]);
    let (code, text) = failed(&wire, &["net", "dump", pipe.to_str().unwrap()]);
    assert_eq!((code, text.contains("not a regular file")), (7, true), "{text}");
}
