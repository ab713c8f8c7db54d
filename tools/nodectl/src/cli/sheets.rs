//! The data sheets of `--eds`: one file, or a folder from which each node gets the data sheet of its identity.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

use eds::{DeviceInfo, Eds};

use super::Failure;
use super::session::sheet;
use crate::text::note;

/// Vendor-ID and product code of a node (1018h:1 and 2), where the node tells them.
pub(super) type Device = (Option<u32>, Option<u32>);

/// The data sheets that the user has named.
#[derive(Default)]
pub(super) enum Sheets {
    #[default]
    None,
    File(Box<Eds>),
    Folder(Vec<Eds>),
}

impl Sheets {
    /// Reads a file, or all data sheets in a folder. Without a path, those in the folder of the user, if there is one. A
    /// file of a folder that is no data sheet is passed over.
    pub(super) fn read(path: Option<&Path>) -> Result<Sheets, Failure> {
        let own = folder_of_user(|variable| env::var_os(variable));
        let Some(path) = path.or_else(|| own.as_deref().filter(|own| is_used(own))) else {
            return Ok(Sheets::None);
        };
        if !path.is_dir() {
            return sheet(path).map(|sheet| Sheets::File(Box::new(sheet)));
        }
        let mut sheets = Vec::new();
        for file in files(path).map_err(|error| Failure::file(path, error))? {
            match sheet(&file) {
                Ok(sheet) => sheets.push(sheet),
                Err(failure) => note(format_args!("passed over: {failure}")),
            }
        }
        match sheets.is_empty() {
            true => Err(Failure::file(path, "there is no data sheet in this folder")),
            false => Ok(Sheets::Folder(sheets)),
        }
    }

    /// The data sheet for a device; `None` where none of them is for it.
    pub(super) fn of(&self, device: Device) -> Option<&Eds> {
        match self {
            Sheets::None => None,
            Sheets::File(sheet) => Some(sheet.as_ref()).filter(|sheet| fits(sheet, device)),
            // The newest of several revisions.
            Sheets::Folder(sheets) => {
                let fitting = sheets.iter().filter(|sheet| is_named(sheet) && fits(sheet, device));
                fitting.max_by_key(|sheet| sheet.device.revision_number)
            }
        }
    }

    /// The only file.
    pub(super) fn file(&self) -> Option<&Eds> {
        if let Sheets::File(sheet) = self { Some(sheet) } else { None }
    }
}

/// The data sheets in a folder, sorted by name.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files: Vec<_> = fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| {
        let ending = file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        ["eds", "dcf"].contains(&ending.to_ascii_lowercase().as_str())
    });
    files.sort();
    Ok(files)
}

/// The folder of data sheets in the configuration of the user (XDG Base Directory Specification; `%APPDATA%` on Windows).
fn folder_of_user(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = || set("HOME").map(|home| home.join(".config"));
    let configuration = set("XDG_CONFIG_HOME").or_else(|| set("APPDATA")).or_else(home)?;
    Some(configuration.join("nodectl").join("eds"))
}

/// Whether the folder of the user has data sheets.
fn is_used(folder: &Path) -> bool {
    files(folder).is_ok_and(|files| !files.is_empty())
}

/// Whether a data sheet tells for which device it is.
fn is_named(sheet: &Eds) -> bool {
    (sheet.device.vendor_number, sheet.device.product_number) != (0, 0)
}

/// Whether a data sheet is for a device, as far as both tell it.
pub(super) fn fits(sheet: &Eds, (vendor, product): Device) -> bool {
    let DeviceInfo { vendor_number, product_number, .. } = sheet.device;
    let is_same = |device: Option<u32>, number: u32| device.is_none_or(|device| device == number);
    !is_named(sheet) || (is_same(vendor, vendor_number) && is_same(product, product_number))
}

/// Why a data sheet does not fit.
pub(super) fn misfit(sheet: &Eds, (vendor, product): Device) -> String {
    let DeviceInfo { vendor_number, product_number, product_name, .. } = &sheet.device;
    let (vendor, product) = (vendor.unwrap_or(0), product.unwrap_or(0));
    format!(
        "the data sheet is for {product_name} (vendor {vendor_number:08X}h, product {product_number:08X}h), \
         and the node is vendor {vendor:08X}h, product {product:08X}h"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet_of(vendor: u32, product: u32, revision: u32) -> Eds {
        let mut sheet = Eds::default();
        sheet.device.vendor_number = vendor;
        sheet.device.product_number = product;
        sheet.device.revision_number = revision;
        sheet
    }

    #[test]
    fn each_device_gets_the_newest_data_sheet_of_its_identity() {
        let folder =
            Sheets::Folder(vec![sheet_of(1, 2, 1), sheet_of(1, 2, 3), sheet_of(1, 5, 9), sheet_of(0, 0, 9)]);
        let found = |vendor, product| folder.of((vendor, product)).map(|sheet| sheet.device.revision_number);
        assert_eq!(found(Some(1), Some(2)), Some(3));
        assert_eq!(found(Some(1), Some(5)), Some(9));
        assert_eq!(found(Some(2), Some(2)), None);
    }

    #[test]
    fn the_folder_of_the_user_is_in_the_configuration() {
        let folder = |set: &[(&str, &str)]| {
            let set = set.to_vec();
            folder_of_user(move |name| {
                set.iter().find(|(one, _)| *one == name).map(|(_, value)| value.into())
            })
        };
        let expected = |path: &str| Some(PathBuf::from(path));
        assert_eq!(folder(&[("HOME", "/home/a")]), expected("/home/a/.config/nodectl/eds"));
        assert_eq!(folder(&[("HOME", "/a"), ("XDG_CONFIG_HOME", "/b")]), expected("/b/nodectl/eds"));
        assert_eq!(folder(&[("HOME", "/a"), ("XDG_CONFIG_HOME", "")]), expected("/a/.config/nodectl/eds"));
        assert_eq!(folder(&[]), None);
    }

    #[test]
    fn a_file_fits_where_nothing_speaks_against_it() {
        let file = Sheets::File(Box::new(sheet_of(1, 2, 1)));
        assert!(file.of((Some(1), Some(2))).is_some());
        assert!(file.of((Some(1), None)).is_some());
        assert!(file.of((Some(1), Some(3))).is_none());
        assert!(file.of((Some(0), Some(2))).is_none());
        assert!(Sheets::File(Box::new(sheet_of(0, 0, 0))).of((Some(7), Some(7))).is_some());
    }
}
