//! The commit record in the last bytes of staging: whether the image there is to be copied.
//!
//! | word | meaning |
//! |---|---|
//! | 0, 1 | magic, programmed when the staged image has passed every check |
//! | 2 | 0: the magic is whole, not just lucky to read well after a cut. From this word on the image is to be copied |
//! | 3 | 0: it was copied, and need not be again while the application is whole |
//!
//! The two words that decide are zeros, because zeros may be programmed once more over a word that a cut left half
//! programmed, and then hold for good. To revoke is to program zeros over everything, the last word first: it comes before
//! every erase of staging, so no erase that is cut can bring a record back.

use crate::flash::{Flash, first, program};
use crate::refusal::Refusal;

/// Bytes at the end of staging.
pub(crate) const RECORD_LEN: u32 = 16;

const MAGIC: [u8; 8] = *b"COPYTHIS";
const ZERO: [u8; 4] = [0; 4];
const CLOSED: u32 = 8;
const DONE: u32 = 12;

/// What the record says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Commit {
    /// Nothing is to be copied.
    None,
    /// A commit was cut; it does not count, but its words may read otherwise next time.
    Torn,
    /// The image is to be copied.
    Pending,
    /// It was copied, and is still there.
    Done,
}

/// The record of the layout, by its offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record(pub(crate) u32);

impl Record {
    pub(crate) fn read<F: Flash>(self, flash: &mut F) -> Result<Commit, Refusal> {
        let mut bytes = [0; RECORD_LEN as usize];
        flash.read(self.0, first(&mut bytes, RECORD_LEN)).map_err(|_| Refusal::Unspecified)?;
        let [m0, m1, m2, m3, m4, m5, m6, m7, marks @ ..] = bytes;
        let committed = [m0, m1, m2, m3, m4, m5, m6, m7] == MAGIC;
        Ok(match marks {
            [0, 0, 0, 0, 0, 0, 0, 0] if committed => Commit::Done,
            [0, 0, 0, 0, ..] if committed => Commit::Pending,
            _ if bytes == [0; 16] || bytes == [0xFF; 16] => Commit::None,
            _ => Commit::Torn,
        })
    }

    /// The staged image is to be copied.
    pub(crate) fn write<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        program(flash, self.0, &MAGIC)?;
        self.close(flash)
    }

    /// Makes a record that reads as pending hold for good.
    pub(crate) fn close<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        program(flash, self.0.saturating_add(CLOSED), &ZERO)
    }

    /// The copy is complete.
    pub(crate) fn done<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        program(flash, self.0.saturating_add(DONE), &ZERO)
    }

    /// Nothing is to be copied, for good. First the record says that there is no need: were the magic cut before that, it
    /// could read well, a copy begin, and the magic be gone in the middle of it.
    pub(crate) fn revoke<F: Flash>(self, flash: &mut F) -> Result<(), Refusal> {
        self.done(flash)?;
        program(flash, self.0, &[0; RECORD_LEN as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::MockFlash;

    const ERASED: [u8; 4] = [0xFF; 4];

    #[test]
    fn the_record_says_what_the_table_says() {
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
            for (at, word) in (0..).step_by(4).zip(words).filter(|(_, word)| *word != ERASED) {
                program(&mut flash, at, &word).unwrap();
            }
            assert_eq!(Record(0).read(&mut flash), Ok(says), "{words:?}");
        }
    }

    #[test]
    fn a_revoked_record_is_none_whatever_it_was() {
        for write in [Record::write, Record::close, Record::done] {
            let mut flash = MockFlash::new(&[64], 1);
            write(Record(0), &mut flash).unwrap();
            Record(0).revoke(&mut flash).unwrap();
            assert_eq!(Record(0).read(&mut flash), Ok(Commit::None));
            assert_eq!(flash.bytes()[..16], [0; 16]);
        }
    }
}
