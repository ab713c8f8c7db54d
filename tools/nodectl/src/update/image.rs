//! The file with the new program.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// A file that is no image.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the file is no image of this project: {0}")]
pub struct ImageError(String);

/// The new program, as it is downloaded.
#[derive(Clone, Debug)]
pub struct Image {
    /// The content of the file.
    pub bytes: Vec<u8>,
    /// What it says of itself; `None` for one of a format that is not known here.
    pub info: Option<ImageInfo>,
}

/// What an image says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageInfo {
    /// The product that it is for, 1018h:2.
    pub product: u32,
    /// Its version.
    pub version: Version,
    /// What 1F56h:1 reads once the node has it.
    pub identification: u32,
}

impl Image {
    /// An image of this project.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(_: Vec<u8>) -> Result<Image, ImageError> {
        Err(ImageError("no header".to_owned()))
    }

    /// An image of any format: nothing about it can be checked here.
    #[must_use]
    pub fn opaque(bytes: Vec<u8>) -> Image {
        Image { bytes, info: None }
    }
}

/// Three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version(pub u16, pub u16, pub u16);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{}.{}", self.0, self.1, self.2)
    }
}

/// What follows the three numbers does not matter.
impl FromStr for Version {
    type Err = ();

    fn from_str(text: &str) -> Result<Version, ()> {
        let numbers = text.split(|c: char| c != '.' && !c.is_ascii_digit()).next().unwrap_or_default();
        let mut numbers = numbers.split('.').map(str::parse);
        match (numbers.next(), numbers.next(), numbers.next()) {
            (Some(Ok(major)), Some(Ok(minor)), Some(Ok(patch))) => Ok(Version(major, minor, patch)),
            _ => Err(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_as_nodes_tell_them() {
        assert_eq!("1.2.3".parse(), Ok(Version(1, 2, 3)));
        assert_eq!("0.10.0-rc1 (abcdef)".parse(), Ok(Version(0, 10, 0)));
        for text in ["", "1.2", "v1.2.3", "loader 1", "1.2.x", "70000.1.1"] {
            assert_eq!(text.parse::<Version>(), Err(()), "{text}");
        }
        assert!(Version(0, 10, 0) > Version(0, 9, 9));
    }
}
