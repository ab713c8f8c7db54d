//! In flashed images, `unsafe` occurs only in the board support. Its modules without registers forbid it on the host. In
//! the others clippy demands a reason for each block (`undocumented_unsafe_blocks`).

use std::fs;
use std::path::{Path, PathBuf};

/// The source folders of the images.
const FLASHED: [&str; 3] = ["crates", "firmware/src", "bootloader/src"];
const PURE: [&str; 5] = ["canopen", "profiles", "storage", "update", "node"];
const BOARD_SUPPORT: &str = "crates/bsp/src";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

fn sources(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

/// Whether the keyword occurs in the code, apart from comments and names of lints.
fn is_unsafe(source: &str) -> bool {
    let code = source.lines().map(|line| line.split("//").next().unwrap_or_default());
    code.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_')).any(|word| word == "unsafe")
}

#[test]
fn unsafe_is_in_the_board_support_only() {
    let files = FLASHED.iter().flat_map(|dir| sources(&root().join(dir)));
    let found: Vec<PathBuf> = files
        .filter(|path| is_unsafe(&fs::read_to_string(path).unwrap()))
        .map(|path| path.strip_prefix(root()).unwrap().to_owned())
        .collect();
    assert!(found.len() > 5, "the board support has some: {found:?}");
    let elsewhere: Vec<_> = found.iter().filter(|path| !path.starts_with(BOARD_SUPPORT)).collect();
    assert!(elsewhere.is_empty(), "{elsewhere:?}");
}

#[test]
fn the_pure_crates_forbid_it() {
    for name in PURE {
        let path = root().join("crates").join(name).join("src/lib.rs");
        let source = fs::read_to_string(path).unwrap();
        assert!(source.lines().any(|line| line == "#![forbid(unsafe_code)]"), "{name}");
    }
}
