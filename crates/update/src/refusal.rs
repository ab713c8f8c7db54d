//! Reasons to refuse an image or a command, with their codes in 1F57h.

use crate::status::Status;
use crate::trial::Reason;

/// Why there is no update or no start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The application area holds no image that may be started.
    NoProgram,
    /// The magic number or the format is unknown to this bootloader.
    UnknownFormat,
    /// The CRC of the header is wrong.
    HeaderCrc,
    /// The CRC of the header is right, but its content is invalid.
    HeaderContent,
    /// The CRC of the code is wrong.
    CodeCrc,
    /// The memory was not cleared before the download, or cannot be erased.
    NotCleared,
    /// The flash does not hold the programmed data.
    Write,
    /// The image is longer than the application area.
    TooLong,
    /// A command that the state does not allow, or a flash that cannot be read.
    Unspecified,
    /// The image is for another board.
    Board {
        /// The board of this node.
        expected: u32,
    },
    /// The image does not run on this hardware.
    Hardware {
        /// The revision of this node.
        revision: u8,
    },
    /// The security counter of the image is lower than that of an image that has run, or than that of the present
    /// application.
    Counter {
        /// The lowest accepted counter.
        least: u32,
    },
    /// The security counter of the image rises further than the release key may raise it.
    CounterStep {
        /// The highest accepted counter.
        most: u32,
    },
    /// The signing key of the image has been revoked: an image with keys of a higher generation has run.
    Revoked {
        /// The lowest accepted generation.
        generation: u32,
    },
    /// The signature is not valid for this image and the key of this node.
    Signature,
    /// The download ended before the image did.
    Truncated,
    /// The download continued after the end of the image.
    Excess,
    /// The application has crashed too often without confirming itself.
    Crashes {
        /// Number of crashes.
        count: u8,
    },
    /// The application has failed its trial, and the previous image was restored.
    TakenBack {
        /// Cause of the failure.
        reason: Reason,
    },
    /// The application is on trial: it must be confirmed or rolled back before the next update.
    OnTrial,
    /// Staging has been cleared too often: see [`crate::Clears`].
    Worn,
}

impl Refusal {
    /// The code in bits 1 to 7 of 1F57h. CiA 302-3 leaves codes above 63 to the manufacturer.
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
            Refusal::Board { .. } => 64,
            Refusal::Hardware { .. } => 65,
            Refusal::Counter { .. } => 66,
            Refusal::Signature => 67,
            Refusal::Truncated => 68,
            Refusal::Excess => 69,
            Refusal::Crashes { .. } => 70,
            Refusal::Revoked { .. } => 71,
            Refusal::TakenBack { .. } => 72,
            Refusal::OnTrial => 73,
            Refusal::CounterStep { .. } => 74,
            Refusal::Worn => 75,
        }
    }

    /// Bits 16 to 31 of 1F57h: the value that the node expects (its low 16 bits), or a count.
    #[must_use]
    pub fn detail(self) -> u16 {
        match self {
            Refusal::Board { expected } => (expected & 0xFFFF) as u16,
            Refusal::Hardware { revision } => revision.into(),
            Refusal::Counter { least: number }
            | Refusal::CounterStep { most: number }
            | Refusal::Revoked { generation: number } => u16::try_from(number).unwrap_or(u16::MAX),
            Refusal::Crashes { count } => count.into(),
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
