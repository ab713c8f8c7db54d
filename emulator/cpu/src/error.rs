//! What can go wrong outside of the emulated program.

use std::fmt;

use unicorn_engine::uc_error;

/// Why a machine could not be made or an image not be loaded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// The CPU library refused; the text names the call.
    Engine(&'static str, uc_error),
    /// The file is not an ELF file, or is cut short.
    NotElf(String),
    /// An ELF file for another machine than a little-endian 32-bit ARM.
    NotArm(String),
    /// A segment does not lie in flash.
    OutOfRange {
        /// First address of the segment.
        address: u32,
        /// Its length in bytes.
        length: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Engine(call, error) => write!(f, "the CPU library failed in {call}: {error:?}"),
            Error::NotElf(reason) => write!(f, "not an ELF file: {reason}"),
            Error::NotArm(found) => write!(f, "not an ELF file for a 32-bit ARM: {found}"),
            Error::OutOfRange { address, length } => {
                write!(f, "the image has {length} bytes for {address:#010x}, which is not in flash")
            }
        }
    }
}

impl std::error::Error for Error {}
