//! The generated files that the project keeps in its tree.

use std::path::{Path, PathBuf};

use crate::{DEVICES, page};

/// A file that is generated.
#[derive(Clone, Debug)]
pub struct File {
    /// The path of the file.
    pub path: PathBuf,
    /// The whole text of the file.
    pub text: String,
}

/// Every generated file: a data sheet for each device, and the reference page.
#[must_use]
pub fn files() -> Vec<File> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."));
    let sheets = DEVICES
        .iter()
        .map(|device| File { path: root.join("eds").join(device.file_name), text: device.sheet() });
    let page = File { path: root.join("docs/object-dictionary.md"), text: page::page(&DEVICES) };
    sheets.chain([page]).collect()
}
