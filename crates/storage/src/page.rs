//! One page as words, and the transactions in it.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::error::Error;
use crate::format::{Check, ERASED, FIRST, HEAD, MARK, TAIL, WORD, unguarded};

/// Where the two pages of the store lie in the flash. Both are of the same size and adjacent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pages {
    start: u32,
    size: u32,
}

impl Pages {
    /// Two pages of `size` bytes each, the first at `start`, an offset from the beginning of the flash.
    #[must_use]
    pub const fn new(start: u32, size: u32) -> Pages {
        Pages { start, size }
    }

    /// The two pages, if a flash of `capacity` bytes that is erased in units of `erase_size` can hold them. The store
    /// takes pages of 64 bytes to 128 KiB, the largest sector of the chip.
    pub(crate) fn split<E>(self, capacity: usize, erase_size: usize) -> Result<[Page; 2], Error<E>> {
        let Pages { start, size } = self;
        let second = start.checked_add(size).ok_or(Error::Geometry)?;
        let end = second.checked_add(size).and_then(|end| usize::try_from(end).ok());
        let is_aligned = |at: u32| usize::try_from(at).is_ok_and(|at| at.is_multiple_of(erase_size));
        let fits = end.is_some_and(|end| end <= capacity);
        if !is_aligned(start) || !is_aligned(size) || !fits || !(64..=128 * 1024).contains(&size) {
            return Err(Error::Geometry);
        }
        Ok([Page { start, size }, Page { start: second, size }])
    }
}

/// One page. Places in it are offsets from its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Page {
    pub(crate) start: u32,
    pub(crate) size: u32,
}

/// A complete transaction whose commit word agrees with its content.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transaction {
    pub(crate) at: u32,
    pub(crate) generation: u16,
    pub(crate) records_end: u32,
    pub(crate) closed: bool,
}

impl Transaction {
    pub(crate) fn end(&self) -> u32 {
        self.records_end + TAIL
    }
}

impl Page {
    pub(crate) fn word<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<u32, F::Error> {
        let mut bytes = [0; WORD as usize];
        flash.read(self.start + at, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Fills `buf` from a place on a word boundary.
    pub(crate) fn bytes<F: ReadNorFlash>(
        self,
        flash: &mut F,
        at: u32,
        buf: &mut [u8],
    ) -> Result<(), F::Error> {
        for (chunk, at) in buf.chunks_mut(WORD as usize).zip((at..self.size).step_by(WORD as usize)) {
            let word = self.word(flash, at)?.to_le_bytes();
            chunk.iter_mut().zip(word).for_each(|(to, from)| *to = from);
        }
        Ok(())
    }

    /// Whether every word from `at` to the end of the page is erased.
    pub(crate) fn erased_from<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<bool, F::Error> {
        for at in (at..self.size).step_by(WORD as usize) {
            if self.word(flash, at)? != ERASED {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The transaction at `at`, if there is a complete one. The begin mark carries no information and is not looked at.
    pub(crate) fn transaction<F: ReadNorFlash>(
        self,
        flash: &mut F,
        at: u32,
    ) -> Result<Option<Transaction>, F::Error> {
        let Head::Whole { generation, records_end } = self.head(flash, at)? else { return Ok(None) };
        let mut check = Check::new(at);
        for at in (at + WORD..records_end).step_by(WORD as usize) {
            check.add(self.word(flash, at)?);
        }
        if self.word(flash, records_end)? != check.commit_word() {
            return Ok(None);
        }
        let closed = self.word(flash, records_end + WORD)? == MARK;
        Ok(Some(Transaction { at, generation, records_end, closed }))
    }

    /// The end of what a save that was cut can have programmed if it began at `at`: the words are programmed in order,
    /// so after a head that is not whole there is nothing, and after a commit word that is wrong no closing mark.
    pub(crate) fn reach_of_a_cut<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<u32, F::Error> {
        Ok(match self.head(flash, at)? {
            Head::Torn { end } => end,
            Head::Whole { records_end, .. } => records_end + WORD,
        })
    }

    fn head<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<Head, F::Error> {
        if at + HEAD + TAIL > self.size {
            return Ok(Head::Torn { end: at });
        }
        let Some(generation) = unguarded(self.word(flash, at + WORD)?) else {
            return Ok(Head::Torn { end: at + 2 * WORD });
        };
        let records_end =
            unguarded(self.word(flash, at + 2 * WORD)?).map(|words| at + HEAD + u32::from(words) * WORD);
        Ok(match records_end {
            Some(records_end) if records_end + TAIL <= self.size => Head::Whole { generation, records_end },
            _ => Head::Torn { end: at + HEAD },
        })
    }

    /// Bytes for transactions in an empty page.
    pub(crate) fn room(self) -> u32 {
        self.size - FIRST
    }
}

/// The words before the records.
enum Head {
    Whole {
        generation: u16,
        records_end: u32,
    },
    /// What was programmed of it ends before `end`.
    Torn {
        end: u32,
    },
}
