//! Why an image or a command is refused, and the code of each reason in 1F57h.

use crate::status::Status;
use crate::trial::Reason;

/// Why there is no update, or no start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The application area holds nothing that may be started.
    NoProgram,
    /// The magic number or the format is none that this bootloader knows.
    UnknownFormat,
    /// The CRC of the header is wrong.
    HeaderCrc,
    /// The CRC of the header is right, its content is not.
    HeaderContent,
    /// The CRC of the code is wrong.
    CodeCrc,
    /// The memory was not cleared before the download, or does not erase.
    NotCleared,
    /// The flash does not hold what was programmed.
    Write,
    /// The image is longer than the application area.
    TooLong,
    /// A command that the state does not allow, or a flash that cannot be read.
    Unspecified,
    /// The image is for another product.
    Product {
        /// The product of this node.
        expected: u32,
    },
    /// The image does not run on this hardware.
    Hardware {
        /// The revision of this node.
        revision: u8,
    },
    /// The security counter of the image is lower than that of one that has run, or of the application in place.
    Counter {
        /// The lowest that is accepted.
        least: u32,
    },
    /// The key that the image is signed with was revoked.
    Revoked {
        /// Its number.
        key: u8,
    },
    /// The signature does not belong to this image and the key of this node.
    Signature,
    /// The download ended before the image did.
    Truncated,
    /// The download went on after the end of the image.
    Excess,
    /// The application has crashed too often without confirming itself.
    Crashes {
        /// How often.
        count: u8,
    },
    /// The application has failed its trial, and the one before is back.
    TakenBack {
        /// Why.
        reason: Reason,
    },
}

impl Refusal {
    /// The code in bits 1 to 7 of 1F57h. CiA 302-3 leaves those above 63 to the manufacturer.
    #[must_use]
    pub fn code(self) -> u8 {
        match self {
            Refusal::NoProgram => 1,
            Refusal::UnknownFormat => 2,
            Refusal::HeaderCrc | Refusal::HeaderContent | Refusal::CodeCrc => 3,
            Refusal::NotCleared => 4,
            Refusal::Write => 5,
            Refusal::TooLong => 6,
            Refusal::Unspecified => 63,
            Refusal::Product { .. } => 64,
            Refusal::Hardware { .. } => 65,
            Refusal::Counter { .. } => 66,
            Refusal::Signature => 67,
            Refusal::Truncated => 68,
            Refusal::Excess => 69,
            Refusal::Crashes { .. } => 70,
            Refusal::Revoked { .. } => 71,
            Refusal::TakenBack { .. } => 72,
        }
    }

    /// What bits 16 to 31 of 1F57h say besides: what the node expects (its low 16 bits), or a count.
    #[must_use]
    pub fn detail(self) -> u16 {
        match self {
            Refusal::Product { expected } => (expected & 0xFFFF) as u16,
            Refusal::Hardware { revision } => revision.into(),
            Refusal::Counter { least } => u16::try_from(least).unwrap_or(u16::MAX),
            Refusal::Crashes { count } => count.into(),
            Refusal::Revoked { key } => key.into(),
            Refusal::TakenBack { reason: Reason::Starts } => 1,
            Refusal::TakenBack { reason: Reason::Withdrawn } => 2,
            _ => 0,
        }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        Status::refused(*self).fmt(f)
    }
}

impl core::error::Error for Refusal {}
