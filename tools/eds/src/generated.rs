//! The generated files that the project keeps in its tree.

use std::path::{Path, PathBuf};

use crate::{DEVICES, Edition, page};

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
    let sheets = DEVICES.iter().map(|device| {
        let path = root.join("eds").join(device.file_name);
        let file = std::fs::read_to_string(&path).unwrap_or_default();
        File { path, text: device.sheet(&Edition::after(&file, device)) }
    });
    let page = File { path: root.join("docs/object-dictionary.md"), text: page::page(&DEVICES) };
    sheets.chain([page]).collect()
}
