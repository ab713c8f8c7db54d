//! An ELF file with the data needed to read its log.

use std::path::Path;

use anyhow::{Context, Result};
use defmt_decoder::Table;

/// The greatest size of an ELF file in bytes, with its debug information.
const LARGEST: u64 = 256 << 20;

/// Parts of the paths of the compiler's own library, and of packages.
const LIBRARIES: [&str; 2] = ["/library/", "/registry/"];

/// The firmware or the bootloader.
pub struct Image {
    /// The path of the file, for messages.
    pub(crate) path: String,
    /// The content of the file.
    pub(crate) elf: Vec<u8>,
    /// The log's format strings; `None` for an image without a log.
    pub(crate) log: Option<Table>,
    /// The start address of the stack, which grows downwards.
    pub(crate) stack_start: Option<u32>,
}

impl Image {
    /// Reads a file; the error is one line that names the file.
    ///
    /// # Errors
    /// When the file cannot be read, or is no ELF file.
    pub fn load(path: &Path) -> Result<Image> {
        let name = path.display().to_string();
        let elf = wire::input::read(path, LARGEST).with_context(|| format!("cannot read {name}"))?;
        Image::parse(&name, elf).with_context(|| format!("{name} is not an image for the board"))
    }

    fn parse(path: &str, elf: Vec<u8>) -> Result<Image> {
        let file = object::File::parse(elf.as_slice()).context("it is not an ELF file")?;
        let stack_start = symbol(&file, "_stack_start");
        let log = Table::parse(&elf).context("its log table cannot be read")?;
        Ok(Image { path: path.to_owned(), elf, log, stack_start })
    }
}

impl Image {
    /// The source file and line of the code at an address: of the innermost inlined function that is the program's own, and no
    /// library's.
    pub(crate) fn place(&self, address: u32) -> Option<String> {
        let loader = addr2line::Loader::new(&self.path).ok()?;
        let mut frames = loader.find_frames(address.into()).ok()?;
        let mut innermost = None;
        while let Ok(Some(frame)) = frames.next() {
            let Some((file, line)) = frame.location.and_then(|place| Some((place.file?, place.line?))) else {
                continue;
            };
            let place = format!("{file}:{line}");
            if !LIBRARIES.iter().any(|library| file.contains(library)) {
                return Some(place);
            }
            innermost.get_or_insert(place);
        }
        innermost
    }
}

fn symbol(file: &object::File, name: &str) -> Option<u32> {
    use object::{Object, ObjectSymbol};
    file.symbol_by_name(name).and_then(|symbol| symbol.address().try_into().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_an_image_is_an_error_of_one_line() {
        for bytes in [&b""[..], b"\x7fELF", b"#!/bin/sh\n"] {
            let error = Image::parse("x", bytes.to_vec()).err().unwrap();
            assert!(!format!("{error:#}").contains('\n'));
        }
        let error = Image::load(Path::new("/nowhere")).err().unwrap();
        assert!(error.to_string().contains("/nowhere"));
    }
}
