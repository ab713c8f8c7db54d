//! The record in the last bytes of staging, and a record of the same form in the last bytes of the kept image.
//!
//! | place | in staging | in the area of the kept image |
//! |---|---|---|
//! | eight bytes | magic: the staged image has passed every check | magic: the copy of the application is complete |
//! | a word | 0: the magic is complete, and the image is pending to be copied | 0: the magic is complete |
//! | a word | 0: the image was copied | 0: the kept image is no longer needed |
//!
//! The second place proves that the magic does not read well after a cut only by chance. From this word on the staged
//! image must be copied, and the kept image can be restored.
//!
//! A word is the unit of programming, 4 or 8 bytes. The two words that decide are zeros, because zeros may be
//! programmed once more over a word that a cut left half programmed, and are then final. To revoke a record, zeros are
//! programmed over the whole record, the last word first. This comes before every erase of the area, so an erase that is cut
//! cannot bring a record back.

use crate::flash::{Flash, all_are, first, program};
use crate::refusal::Refusal;

/// Bytes at the end of the area for the record and for the marks of the trial ([`crate::Trial`]).
pub(crate) const RECORD_ROOM: u32 = 512;
/// Length of the longest record in bytes: with words of 8 bytes.
const RECORD_LEN: usize = 24;

const MAGIC: [u8; 8] = *b"COPYTHIS";
const MAGIC_LEN: u32 = 8;

/// State of the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Commit {
    /// Nothing is to be done.
    None,
    /// The record was cut. It does not count, but its words may read differently next time.
    Torn,
    /// The image is to be copied, or may have to be copied.
    Pending,
    /// The image is no longer needed, but is still there.
    Done,
}

/// The record, identified by the end of its area as an offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record(pub(crate) u32);

impl Record {
    /// The state of the record. A flash that cannot be read counts as empty.
    pub(crate) fn read<F: Flash>(self, flash: &mut F) -> Commit {
        let word = flash.word_size();
        let mut bytes = [0; RECORD_LEN];
        let record = first(&mut bytes, len(word));
        if flash.read(self.start(word), record).is_err() {
            return Commit::None;
        }
        let (magic, marks) = record.split_at(record.len().min(MAGIC.len()));
        let (closed, done) = marks.split_at(marks.len().min(word as usize));
        match (all_are(closed, 0), all_are(done, 0)) {
            (true, true) if magic == MAGIC => Commit::Done,
            (true, false) if magic == MAGIC => Commit::Pending,
            _ if all_are(record, 0) || all_are(record, 0xFF) => Commit::None,
            _ => Commit::Torn,
        }
    }

    /// Marks the image as complete and pending.
    pub(crate) fn write<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        let start = self.start(flash.word_size());
        program(flash, start, &MAGIC)?;
        self.close(flash)
    }

    /// Makes a record that reads as pending final.
    pub(crate) fn close<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        let word = flash.word_size();
        mark(flash, self.start(word).saturating_add(MAGIC_LEN))
    }

    /// Marks the image as no longer pending.
    pub(crate) fn done<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        let word = flash.word_size();
        mark(flash, self.0.saturating_sub(word))
    }

    /// Revokes the record for good. It is first marked as done: if the magic were cut without this mark, it could read
    /// well, a copy could begin, and the magic could vanish during the copy.
    pub(crate) fn revoke<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        self.done(flash)?;
        let word = flash.word_size();
        program(flash, self.start(word), first(&mut [0; RECORD_LEN], len(word)))
    }

    fn start(self, word: u32) -> u32 {
        self.0.saturating_sub(len(word))
    }
}

/// Length of a record in bytes, in a flash with words of `word` bytes.
fn len(word: u32) -> u32 {
    MAGIC_LEN.saturating_add(word).saturating_add(word).min(RECORD_ROOM)
}

/// Programs a word of zeros.
pub(crate) fn mark<F: Flash>(flash: &mut F, at: u32) -> Result<(), Refusal> {
    let word = flash.word_size();
    program(flash, at, first(&mut [0; 8], word))
}

/// Whether the word at `at` is zero. A word that cannot be read has these bytes.
#[inline(never)] // Many callers, and little room in flash.
pub(crate) fn is_zero<F: Flash>(flash: &mut F, at: u32, unread: u8) -> bool {
    let mut word = [0; 4];
    if flash.read(at, &mut word).is_err() {
        word = [unread; 4];
    }
    word == [0; 4]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::MockFlash;

    const ERASED: [u8; 4] = [0xFF; 4];
    const ZERO: [u8; 4] = [0; 4];

    #[test]
    fn the_record_agrees_with_the_table() {
        let (first, second) = (*b"COPY", *b"THIS");
        for (words, says) in [
            ([ERASED; 4], Commit::None),
            ([ZERO; 4], Commit::None),
            ([first, second, ERASED, ERASED], Commit::Torn),
            ([first, second, ZERO, ERASED], Commit::Pending),
            ([first, second, ZERO, ZERO], Commit::Done),
            ([first, second, ERASED, ZERO], Commit::Torn),
            ([first, ERASED, ERASED, ERASED], Commit::Torn),
            ([first, ERASED, ZERO, ERASED], Commit::Torn),
            ([ERASED, second, ZERO, ZERO], Commit::Torn),
            ([ZERO, second, ZERO, ZERO], Commit::Torn),
            ([ERASED, ERASED, ERASED, ZERO], Commit::Torn),
        ] {
            let mut flash = MockFlash::new(&[64], 1);
            for (at, word) in (48..).step_by(4).zip(words).filter(|(_, word)| *word != ERASED) {
                program(&mut flash, at, &word).unwrap();
            }
            assert_eq!(Record(64).read(&mut flash), says, "{words:?}");
        }
    }

    #[test]
    fn a_revoked_record_is_never_valid() {
        for (word, len) in [(4, 16), (8, 24)] {
            for write in [Record::write, Record::close, Record::done] {
                let mut flash = MockFlash::with_words(&[64], word, 1);
                write(Record(64), &mut flash).unwrap();
                Record(64).revoke(&mut flash).unwrap();
                assert_eq!(Record(64).read(&mut flash), Commit::None);
                assert_eq!(flash.bytes()[64 - len..], [0; 24][..len]);
                assert_eq!(flash.bytes()[..64 - len], [0xFF; 64][..64 - len]);
            }
        }
    }

    #[test]
    fn every_mark_has_a_word_of_its_own() {
        for word in [4, 8] {
            let mut flash = MockFlash::with_words(&[64], word, 1);
            Record(64).write(&mut flash).unwrap();
            assert_eq!(Record(64).read(&mut flash), Commit::Pending);
            Record(64).done(&mut flash).unwrap();
            assert_eq!(Record(64).read(&mut flash), Commit::Done);
        }
    }
}
