//! The defaults in the header of this project's application.

use anyhow::{Context, Result};
use ed25519_dalek::SigningKey;
use update::{Description, Version};

use crate::sign::code;
use crate::sign::image::Image;
use crate::sign::key;

/// The board code that the bootloader accepts (2004h:1). An image contains all personalities.
pub const BOARD: u32 = profiles::product::BOARD;
/// The set of hardware revisions, a bit for each: only revision 0 exists.
pub const HARDWARE: u32 = 1;

/// Reads a version as `1.2.3`.
///
/// # Errors
/// The text is not a version.
pub fn version(text: &str) -> Result<Version> {
    let numbers: Vec<u16> = text.split('.').map(str::parse).collect::<Result<_, _>>()?;
    let numbers: [u16; 3] = numbers.try_into().ok().context("three numbers with points between them")?;
    let [major, minor, patch] = numbers;
    Ok(Version { major, minor, patch })
}

/// The image of an application in the version of this project, signed with this key.
///
/// # Errors
/// The file is no application.
pub fn image(file: &[u8], key: &SigningKey) -> Result<Image> {
    let version = version(env!("CARGO_PKG_VERSION"))?;
    let about = Description { board: BOARD, hardware: HARDWARE, version, ..Description::default() };
    Image::sign(about, code::read(file)?, key)
}

/// The image of an application in the version of this project, signed with the development key.
///
/// # Errors
/// The file is no application.
pub fn development_image(file: &[u8]) -> Result<Image> {
    image(file, &key::development())
}
