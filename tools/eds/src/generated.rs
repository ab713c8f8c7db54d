//! The generated files that the project keeps in its tree.

use std::path::{Path, PathBuf};

use crate::{DEVICES, Edition, data_sheet, page};

/// A file that is generated.
#[derive(Clone, Debug)]
pub struct File {
    /// The path of the file.
    pub path: PathBuf,
    /// The whole text of the file.
    pub text: String,
}

/// Every generated file: an EDS for each device, the reference page, and the data sheet of the product.
#[must_use]
pub fn files() -> Vec<File> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."));
    let sheets = DEVICES.iter().map(|device| {
        let path = root.join("eds").join(device.file_name);
        let file = std::fs::read_to_string(&path).unwrap_or_default();
        File { path, text: device.sheet(&Edition::after(&file, device)) }
    });
    let documents = root.join("docs");
    let page = File { path: documents.join("object-dictionary.md"), text: page::page(&DEVICES) };
    let data_sheet = File { path: documents.join("data-sheet.md"), text: data_sheet::text(&documents) };
    sheets.chain([page, data_sheet]).collect()
}
