//! The words of a page; the documentation of the crate has a picture. All numbers are little-endian.

use crate::checksum::{self, Digest};

use crate::group::GroupSet;

/// Bytes of a word of the format. The flash may program more bytes at once: see [`Format`].
pub(crate) const WORD: u32 = 4;
/// A word that has not been programmed since the page was erased.
pub(crate) const ERASED: u32 = u32::MAX;
/// The value of a word whose only information is that it was programmed. All bits are programmed. If a power cut has
/// left the word half programmed but reading as erased, it may therefore be programmed once more.
pub(crate) const MARK: u32 = 0;
/// First word of a page whose erase has finished; the digit is the version of this format.
pub(crate) const CLEAN: u32 = u32::from_le_bytes(*b"PRM2");
/// The largest unit of programming in bytes.
pub(crate) const LARGEST_UNIT: u32 = 32;

/// The places in a page. A word that is programmed on its own has a unit of the flash for itself, because a flash with
/// check bits programs a unit only once. Consecutive words share units; the rest of the last unit is filled with zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    /// Unit of programming in bytes: 4, 8, 16 or 32.
    pub(crate) unit: u32,
}

impl Format {
    /// `None` for an invalid unit.
    pub(crate) const fn new(unit: u32) -> Option<Format> {
        match unit {
            WORD | 8 | 16 | LARGEST_UNIT => Some(Format { unit }),
            _ => None,
        }
    }

    /// The place of the mark that the store has moved away from the page.
    pub(crate) fn left_at(self) -> u32 {
        self.unit
    }

    /// The place of the first transaction of a page.
    pub(crate) fn first(self) -> u32 {
        2 * self.unit
    }

    /// Size of the part of a transaction before its records: begin mark; contents.
    pub(crate) fn head(self) -> u32 {
        2 * self.unit
    }

    /// Size of the part of a transaction after its records: commit word, closing mark.
    pub(crate) fn tail(self) -> u32 {
        2 * self.unit
    }

    /// Size of the part of a record before its value: group, kind and version; length and generation.
    pub(crate) fn record_head(self) -> u32 {
        self.padded(2 * WORD)
    }

    /// Size of a value of `len` bytes with its check word, in whole units.
    pub(crate) fn body(self, len: u32) -> u32 {
        self.padded(in_words(len) + WORD)
    }

    /// `len` rounded up to whole units. A unit is a power of two, so no division is needed that could be by zero.
    pub(crate) fn padded(self, len: u32) -> u32 {
        let most = self.unit.wrapping_sub(1);
        len.wrapping_add(most) & !most
    }
}

/// The kinds of a record.
pub(crate) const KIND_VALUE: u8 = 1;
pub(crate) const KIND_RESTORED: u8 = 2;

/// `len` rounded up to whole words.
pub(crate) fn in_words(len: u32) -> u32 {
    len.wrapping_add(WORD - 1) & !(WORD - 1)
}

/// A number and its complement. A half-programmed word lacks some zeros in one half or the other, so it is never
/// another valid number; nor is a word with an odd number of flipped bits.
pub(crate) fn guarded(value: u16) -> u32 {
    u32::from(value) | u32::from(!value) << 16
}

/// Number of bits in [`Contents`] for the number of words: enough for four values of [`crate::MAX_VALUE`].
const WORDS: u32 = 12;

/// Head of a transaction: the number of words of its records, and the groups of the records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Contents {
    pub(crate) words: u16,
    pub(crate) groups: GroupSet,
}

impl Contents {
    /// The guarded word; `None` for more words than a transaction can have.
    pub(crate) fn word(self) -> Option<u32> {
        (self.words >> WORDS == 0).then(|| guarded(self.words | u16::from(self.groups.0) << WORDS))
    }

    /// The contents in a guarded word.
    pub(crate) fn of(word: u32) -> Option<Contents> {
        let [low, high] = unguarded(word)?.to_le_bytes();
        let (number, groups) = (u16::from_le_bytes([low, high]), GroupSet(high >> 4));
        Some(Contents { words: number & ((1 << WORDS) - 1), groups })
    }
}

/// The number in a guarded word.
pub(crate) fn unguarded(word: u32) -> Option<u16> {
    let [low, high, ..] = word.to_le_bytes();
    let value = u16::from_le_bytes([low, high]);
    (guarded(value) == word).then_some(value)
}

/// The running checksum of a transaction or of a record.
pub(crate) struct Check(Digest);

impl Check {
    /// Begins with the place in the page, so that a copy elsewhere, for example inside a value, is not valid.
    pub(crate) fn new(at: u32) -> Check {
        let mut check = Check(checksum::begin());
        check.add(at);
        check
    }

    pub(crate) fn add(&mut self, word: u32) {
        self.0.update(&word.to_le_bytes());
    }

    /// The commit word: the CRC, but never the value of an erased word.
    pub(crate) fn commit_word(self) -> u32 {
        match self.0.finalize() {
            ERASED => !ERASED,
            crc => crc,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guarded_word_that_is_torn_is_never_another_number() {
        for value in [0, 1, 0x5A5A, 0x7FFF, u16::MAX] {
            let word = guarded(value);
            assert_eq!(unguarded(word), Some(value));
            for first in 0..32 {
                for second in 0..32 {
                    let missing = (1 << first | 1 << second) & !word;
                    assert_eq!(unguarded(word | missing), (missing == 0).then_some(value));
                }
            }
        }
        assert_eq!(unguarded(ERASED), None);
    }

    #[test]
    fn a_commit_word_never_reads_as_erased() {
        let mut check = Check::new(8);
        // After a word that equals the register, the register is 0 and the CRC is all ones.
        let word = !checksum::of(&8_u32.to_le_bytes());
        check.add(word);
        let bytes = [8_u32.to_le_bytes(), word.to_le_bytes()].concat();
        assert_eq!(checksum::of(&bytes), ERASED);
        assert_eq!(check.commit_word(), 0);
    }
}
