//! The words of a page; the picture is in the documentation of the crate. All numbers are little-endian.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

use crate::group::GroupSet;

/// A word of the format. The flash may program more at once: see [`Format`].
pub(crate) const WORD: u32 = 4;
/// A word that was not programmed since the page was erased.
pub(crate) const ERASED: u32 = u32::MAX;
/// The value of a word that says something by being programmed at all. All bits are programmed, so doing it
/// once more after a cut that left the word half programmed but reading as erased is sound.
pub(crate) const MARK: u32 = 0;
/// First word of a page whose erase has run to its end; the digit is the version of this format.
pub(crate) const CLEAN: u32 = u32::from_le_bytes(*b"PRM2");
/// The most bytes that a flash may program as one.
pub(crate) const LARGEST_UNIT: u32 = 32;

/// Where things are in a page. What is programmed on its own has a unit of the flash for itself: a flash with check bits
/// programs a unit once. The words that follow each other fill units; zeros fill what is left of the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    /// Bytes that the flash programs as one: 4, 8, 16 or 32.
    pub(crate) unit: u32,
}

impl Format {
    /// `None` for a unit that is none.
    pub(crate) const fn new(unit: u32) -> Option<Format> {
        match unit {
            WORD | 8 | 16 | LARGEST_UNIT => Some(Format { unit }),
            _ => None,
        }
    }

    /// Where the mark of a page is that the store has moved away from.
    pub(crate) fn left_at(self) -> u32 {
        self.unit
    }

    /// Where the first transaction of a page begins.
    pub(crate) fn first(self) -> u32 {
        2 * self.unit
    }

    /// Size of what precedes the records of a transaction: begin mark; contents.
    pub(crate) fn head(self) -> u32 {
        2 * self.unit
    }

    /// Size of what follows the records: commit word, closing mark.
    pub(crate) fn tail(self) -> u32 {
        2 * self.unit
    }

    /// Size of what precedes the value of a record: group, kind and version; length and generation.
    pub(crate) fn record_head(self) -> u32 {
        self.padded(2 * WORD)
    }

    /// Size of a value of `len` bytes and of the check word behind it: whole units.
    pub(crate) fn body(self, len: u32) -> u32 {
        self.padded(in_words(len) + WORD)
    }

    /// Bytes that something takes up: whole units. A unit is a power of two, so there is no division that could be by zero.
    pub(crate) fn padded(self, len: u32) -> u32 {
        let most = self.unit.wrapping_sub(1);
        len.wrapping_add(most) & !most
    }
}

/// The kinds of a record.
pub(crate) const KIND_VALUE: u8 = 1;
pub(crate) const KIND_RESTORED: u8 = 2;

/// The bytes of so many whole words that a value of `len` bytes fits.
pub(crate) fn in_words(len: u32) -> u32 {
    len.wrapping_add(WORD - 1) & !(WORD - 1)
}

/// A reference, as the linker keeps one of equal constants of several crates, but every static: the table takes 1 KiB.
static CRC: &Crc<u32> = &Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// A number beside its complement. A torn word has some zeros of the target missing, in one half or the other, so
/// it is never another valid number; nor is a word with an odd count of flipped bits.
pub(crate) fn guarded(value: u16) -> u32 {
    u32::from(value) | u32::from(!value) << 16
}

/// How many bits of [`Contents`] are the number of words: enough for four values of [`crate::MAX_VALUE`].
const WORDS: u32 = 12;

/// Head of a transaction: the number of words of its records, and the groups that they belong to.
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

/// The running check of a transaction or of a record.
pub(crate) struct Check(Digest<'static, u32>);

impl Check {
    /// Begins with the place in the page, so that what is found elsewhere, as a copy in a value, is none.
    pub(crate) fn new(at: u32) -> Check {
        let mut check = Check(CRC.digest());
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
        // After the word that is what the register holds, the register is 0 and the CRC all ones.
        let word = !CRC.checksum(&8_u32.to_le_bytes());
        check.add(word);
        let bytes = [8_u32.to_le_bytes(), word.to_le_bytes()].concat();
        assert_eq!(CRC.checksum(&bytes), ERASED);
        assert_eq!(check.commit_word(), 0);
    }
}
