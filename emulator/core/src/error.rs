//! What can go wrong outside of the emulated program.

use thiserror::Error as ThisError;
use unicorn_engine::uc_error;

/// What cannot be done.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
pub enum Error {
    /// The ELF file is not a program for this chip.
    #[error("{0}")]
    Elf(String),
    /// More bytes than the flash array has.
    #[error("{0} bytes do not fit the flash")]
    FlashSize(usize),
    /// The CPU library refused.
    #[error("the CPU library failed: {0:?}")]
    Engine(uc_error),
}

impl From<uc_error> for Error {
    fn from(error: uc_error) -> Error {
        Error::Engine(error)
    }
}
