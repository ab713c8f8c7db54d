//! The file with the new program.

use ::update::{HEADER_LEN, Header, Version};
use crc::{CRC_32_ISO_HDLC, Crc};
use thiserror::Error;

/// Why a file is no complete image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ImageError {
    /// The file is an ELF file of the compiler: it has no signature, and no node accepts it.
    #[error(
        "it is an ELF file; nodes take the signed image that `cargo xtask sign` makes of it (firmware.img)"
    )]
    Elf,
    /// The file does not begin with the header of an image.
    #[error("it is no image of this project: {0}")]
    Header(::update::Refusal),
    /// The file is shorter than the header of an image.
    #[error("it has {0} bytes: too short for an image (firmware.img)")]
    Short(usize),
    /// The image has another length than its header says.
    #[error("it has {found} bytes and should have {expected}")]
    Length {
        /// The length in the header.
        expected: usize,
        /// The length of the file.
        found: usize,
    },
    /// The content does not match the checksum in the header.
    #[error("its checksum is wrong")]
    Checksum,
}

/// The downloaded bytes of the new program.
#[derive(Clone, Debug)]
pub struct Image {
    /// The content of the file.
    pub bytes: Vec<u8>,
    /// The data of the header; `None` for a file of an unknown format.
    pub info: Option<ImageInfo>,
}

/// The data in the header of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageInfo {
    /// The code of the board that the image is for, 2004h:1.
    pub board: u32,
    /// The version of the image.
    pub version: Version,
    /// The value of 1F56h:1 once the node has the image.
    pub identification: u32,
}

impl Image {
    /// Reads a complete image of this project. The signature is not checked here, but by the node.
    ///
    /// # Errors
    /// The error in the image.
    pub fn parse(bytes: Vec<u8>) -> Result<Image, ImageError> {
        let info = info(&bytes)?;
        Ok(Image { bytes, info: Some(info) })
    }

    /// An image of another format, of which nothing can be checked here.
    #[must_use]
    pub fn opaque(bytes: Vec<u8>) -> Image {
        Image { bytes, info: None }
    }
}

fn info(bytes: &[u8]) -> Result<ImageInfo, ImageError> {
    if bytes.starts_with(b"\x7fELF") {
        return Err(ImageError::Elf);
    }
    let short = ImageError::Short(bytes.len());
    let (head, code) = bytes.split_first_chunk::<HEADER_LEN>().ok_or(short)?;
    let header = Header::parse(head).map_err(ImageError::Header)?;
    let expected = HEADER_LEN + header.length() as usize;
    if bytes.len() != expected {
        return Err(ImageError::Length { expected, found: bytes.len() });
    }
    if Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(code) != header.code_crc() {
        return Err(ImageError::Checksum);
    }
    let description = header.description();
    let identification = header.code_crc();
    Ok(ImageInfo { board: description.board, version: description.version, identification })
}

/// The version that a node tells in 100Ah: three numbers, and anything after them.
pub(crate) fn version(text: &str) -> Option<Version> {
    let numbers = text.split(|c: char| c != '.' && !c.is_ascii_digit()).next()?;
    let mut numbers = numbers.split('.').map(|number| number.parse().ok());
    Some(Version { major: numbers.next()??, minor: numbers.next()??, patch: numbers.next()?? })
}

#[cfg(test)]
mod tests {
    use ::update::Description;

    use super::*;

    const VERSION: Version = Version { major: 1, minor: 2, patch: 3 };

    fn file() -> Vec<u8> {
        let description = Description { board: 1, hardware: 1, version: VERSION, ..Description::default() };
        let code = [0x5A; 100];
        let header = Header::describe(description, &code).expect("a header");
        [header.encode().as_slice(), &code].concat()
    }

    #[test]
    fn a_complete_image_has_an_identification() {
        let info = Image::parse(file()).unwrap().info.unwrap();
        assert_eq!((info.board, info.version), (1, VERSION));
    }

    #[test]
    fn other_files_are_rejected_before_they_reach_the_bus() {
        let mut wrong = file();
        wrong[600] ^= 1;
        assert_eq!(Image::parse(wrong).unwrap_err(), ImageError::Checksum);
        let mut wrong = file();
        wrong[0] ^= 1;
        assert!(matches!(Image::parse(wrong), Err(ImageError::Header(_))));
        let short = Image::parse(file()[..611].to_vec()).unwrap_err();
        assert_eq!(short.to_string(), "it has 611 bytes and should have 612");
        assert!(matches!(Image::parse(vec![1, 2, 3]), Err(ImageError::Short(3))));
    }

    #[test]
    fn versions_as_nodes_tell_them() {
        assert_eq!(version("1.2.3"), Some(VERSION));
        assert_eq!(version("1.2.3-rc1 (abcdef)"), Some(VERSION));
        for text in ["", "1.2", "v1.2.3", "loader 1", "1.2.x", "70000.1.1"] {
            assert_eq!(version(text), None, "{text}");
        }
    }
}
