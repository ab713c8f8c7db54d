//! 1F57h in words.

use std::fmt;

/// Object 1F57h:1, the status of the flash (CiA 302-3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// It is being erased, programmed or checked; the rest says nothing yet.
    pub busy: bool,
    /// What came of it: 0 for good.
    pub code: u8,
    /// What the manufacturer adds.
    pub detail: u16,
}

impl Status {
    /// The status in the value of the object.
    #[must_use]
    pub fn from_word(word: u32) -> Status {
        let [low, _, detail @ ..] = word.to_le_bytes();
        Status { busy: low & 1 != 0, code: low >> 1, detail: u16::from_le_bytes(detail) }
    }
}

impl Status {
    /// Whether there is a program that can be started.
    pub(super) fn is_good(self) -> bool {
        !self.busy && self.code == 0
    }

    /// Whether it is that of a flash without a program: nothing wrong, or no valid program.
    pub(super) fn is_cleared(self) -> bool {
        !self.busy && self.code <= 1
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let words = match self.code {
            _ if self.busy => "busy",
            0 => "ok",
            1 => "no valid program",
            2 => "the format of the image is unknown",
            3 => "format or CRC error",
            4 => "the flash was not cleared",
            5 => "write error",
            6 => "address error",
            7 => "the flash is secured",
            63 => "unspecified error",
            code => return write!(f, "error {code} of the manufacturer, detail {}", self.detail),
        };
        f.write_str(words)
    }
}
