//! The flash status, 1F57h (CiA 302-3): a word for the bus, text for people.

use core::fmt;

use crate::refusal::Refusal;

/// Object 1F57h:1. The code is meaningless while the node is busy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// The flash is being erased, programmed or checked.
    pub busy: bool,
    /// Result code of 7 bits: 0 for success.
    pub code: u8,
    /// Detail of the code; see [`Refusal::detail`].
    pub detail: u16,
}

impl Status {
    /// No command in progress, and no error: a word of 0.
    pub const GOOD: Status = Status { busy: false, code: 0, detail: 0 };
    /// An operation is in progress.
    pub const BUSY: Status = Status { busy: true, code: 0, detail: 0 };

    /// A refused image or command.
    #[must_use]
    pub fn refused(refusal: Refusal) -> Status {
        Status { busy: false, code: refusal.code(), detail: refusal.detail() }
    }

    /// The word: bit 0 busy, bits 1 to 7 the code, bits 16 to 31 the detail.
    #[must_use]
    pub fn word(self) -> u32 {
        u32::from(self.busy) | u32::from(self.code & 0x7F) << 1 | u32::from(self.detail) << 16
    }

    /// The status in a word that was read from a node. Bits 8 to 15 have no meaning.
    #[must_use]
    pub fn from_word(word: u32) -> Status {
        let [low, _, detail @ ..] = word.to_le_bytes();
        Status { busy: low & 1 != 0, code: low >> 1, detail: u16::from_le_bytes(detail) }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let detail = self.detail;
        if self.busy {
            return f.write_str("busy");
        }
        match self.code {
            0 => f.write_str("ok"),
            1 => f.write_str("no valid program"),
            2 => f.write_str("the format of the image is unknown"),
            3 => f.write_str("format or CRC error"),
            4 => f.write_str("the flash was not cleared before the download, or does not erase"),
            5 => f.write_str("the flash does not hold what was programmed"),
            6 => f.write_str("address error: the image is longer than the memory for it"),
            7 => f.write_str("the flash is secured"),
            63 => f.write_str("unspecified error"),
            64 => write!(
                f,
                "the image is for another board (the code of the node, 2004h:1, ends with {detail:04X}h)"
            ),
            65 => write!(f, "the image does not run on hardware revision {detail}"),
            66 => write!(f, "the security counter is too low (the node asks for {detail} or more)"),
            67 => f.write_str("the signature is not good"),
            68 => f.write_str("the download ended before the image did"),
            69 => f.write_str("the download went on after the end of the image"),
            70 => write!(f, "the application crashed {detail} times without confirming itself"),
            72 if detail == 1 => f.write_str(
                "the new program started three times without being confirmed; the previous program runs again",
            ),
            72 => f.write_str(
                "the new program was not confirmed in time, or was rolled back; the previous program runs again",
            ),
            73 => f.write_str("the program is on trial: confirm it or roll it back before the next update"),
            71 => {
                write!(f, "the key of the image is revoked (the node asks for generation {detail} or more)")
            }
            74 => write!(
                f,
                "the security counter rises too far (the node takes {detail} at most without a key list that allows more)"
            ),
            75 => f.write_str(
                "staging was cleared too often: wait 18 minutes, or switch the power of the node off and on",
            ),
            code => write!(f, "error {code} of the manufacturer, detail {detail}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::string::ToString;
    use std::vec::Vec;

    use super::*;
    use crate::trial::Reason;

    const ALL: [Refusal; 21] = [
        Refusal::NoProgram,
        Refusal::UnknownFormat,
        Refusal::HeaderCrc,
        Refusal::HeaderContent,
        Refusal::CodeCrc,
        Refusal::NotCleared,
        Refusal::Write,
        Refusal::TooLong,
        Refusal::Unspecified,
        Refusal::Board { expected: 0x1234_5678 },
        Refusal::Hardware { revision: 3 },
        Refusal::Counter { least: 70_000 },
        Refusal::Signature,
        Refusal::Truncated,
        Refusal::Excess,
        Refusal::Crashes { count: 3 },
        Refusal::Revoked { generation: 1 },
        Refusal::CounterStep { most: 70_000 },
        Refusal::TakenBack { reason: Reason::Starts },
        Refusal::OnTrial,
        Refusal::Worn,
    ];

    #[test]
    fn every_word_reads_back() {
        for status in ALL.map(Status::refused).into_iter().chain([Status::GOOD, Status::BUSY]) {
            assert_eq!(Status::from_word(status.word()), status);
        }
        assert_eq!(Status::GOOD.word(), 0);
        assert_eq!(Status::BUSY.word(), 1);
        assert_eq!(Status::refused(Refusal::CodeCrc).word(), 6);
        assert_eq!(Status::refused(Refusal::Board { expected: 0x1234_5678 }).word(), 0x5678_0080);
    }

    #[test]
    fn the_detail_is_the_expected_value_or_a_count() {
        for (refusal, detail) in [
            (Refusal::Board { expected: 0x1234_5678 }, 0x5678),
            (Refusal::Hardware { revision: 3 }, 3),
            (Refusal::Counter { least: 9 }, 9),
            (Refusal::Counter { least: 70_000 }, u16::MAX),
            (Refusal::Crashes { count: 5 }, 5),
            (Refusal::Revoked { generation: 1 }, 1),
            (Refusal::CounterStep { most: 25 }, 25),
            (Refusal::TakenBack { reason: Reason::Withdrawn }, 2),
            (Refusal::Signature, 0),
        ] {
            assert_eq!(Status::refused(refusal).detail, detail, "{refusal}");
        }
    }

    #[test]
    fn no_refusal_is_ok_and_each_code_has_words_of_its_own() {
        let mut texts: Vec<_> = ALL.map(|refusal| (refusal.code(), refusal.to_string())).to_vec();
        texts.dedup();
        assert!(texts.iter().all(|(code, text)| (1..=127).contains(code) && !text.contains("manufacturer")));
        let mut codes: Vec<_> = texts.iter().map(|(code, _)| *code).collect();
        codes.dedup();
        assert_eq!(codes.len(), texts.len());
        assert_eq!(
            Refusal::Counter { least: 9 }.to_string(),
            "the security counter is too low (the node asks for 9 or more)"
        );
    }
}
