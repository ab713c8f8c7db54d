//! One page as words, and the transactions in it.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::error::Error;
use crate::format::{Check, ERASED, Format, MARK, WORD, unguarded};

/// Where the two pages of the store lie in the flash. Both are of the same size and adjacent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pages {
    start: u32,
    size: u32,
    unit: u32,
}

impl Pages {
    /// Two pages of `size` bytes each, the first at `start`, an offset from the beginning of the flash. The flash
    /// programs words of four bytes.
    #[must_use]
    pub const fn new(start: u32, size: u32) -> Pages {
        Pages { start, size, unit: WORD }
    }

    /// The same pages in a flash that programs `bytes` as one: 4, 8, 16 or 32, a multiple of its `WRITE_SIZE`.
    #[must_use]
    pub const fn with_words(self, bytes: u32) -> Pages {
        Pages { unit: bytes, ..self }
    }

    /// Whether a flash that programs `write_size` bytes as one can take what is written.
    pub(crate) fn suits(self, write_size: usize) -> bool {
        usize::try_from(self.unit).is_ok_and(|unit| unit.is_multiple_of(write_size))
    }

    /// The two pages, if a flash of `capacity` bytes that is erased in units of `erase_size` can hold them. The store
    /// takes pages of 64 bytes to 128 KiB, whole units each.
    pub(crate) fn split<E>(self, capacity: usize, erase_size: usize) -> Result<[Page; 2], Error<E>> {
        let Pages { start, size, unit } = self;
        let format = Format::new(unit).ok_or(Error::Geometry)?;
        let second = start.checked_add(size).ok_or(Error::Geometry)?;
        let end = second.checked_add(size).and_then(|end| usize::try_from(end).ok());
        let is_aligned = |at: u32| usize::try_from(at).is_ok_and(|at| at.is_multiple_of(erase_size));
        let fits = end.is_some_and(|end| end <= capacity);
        if !is_aligned(start)
            || !is_aligned(size)
            || !fits
            || !size.is_multiple_of(unit)
            || !(64..=128 * 1024).contains(&size)
        {
            return Err(Error::Geometry);
        }
        Ok([Page { start, size, format }, Page { start: second, size, format }])
    }
}

/// One page. Places in it are offsets from its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Page {
    pub(crate) start: u32,
    pub(crate) size: u32,
    pub(crate) format: Format,
}

/// A complete transaction whose commit word agrees with its content.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transaction {
    pub(crate) at: u32,
    pub(crate) generation: u16,
    pub(crate) records_end: u32,
    pub(crate) end: u32,
    pub(crate) closed: bool,
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
        let unit = self.format.unit;
        for at in (at + unit..records_end).step_by(WORD as usize) {
            check.add(self.word(flash, at)?);
        }
        if self.word(flash, records_end)? != check.commit_word() {
            return Ok(None);
        }
        let closed = self.word(flash, records_end + unit)? == MARK;
        Ok(Some(Transaction { at, generation, records_end, end: records_end + self.format.tail(), closed }))
    }

    /// The end of what a save that was cut can have programmed if it began at `at`: the words are programmed in order,
    /// so after a head that is not whole there is nothing, and after a commit word that is wrong no closing mark.
    pub(crate) fn reach_of_a_cut<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<u32, F::Error> {
        Ok(match self.head(flash, at)? {
            Head::Torn { end } => end,
            Head::Whole { records_end, .. } => records_end + self.format.unit,
        })
    }

    fn head<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<Head, F::Error> {
        let (head, tail, unit) = (self.format.head(), self.format.tail(), self.format.unit);
        if at + head + tail > self.size {
            return Ok(Head::Torn { end: at });
        }
        let generation = unguarded(self.word(flash, at + unit)?);
        let words = unguarded(self.word(flash, at + unit + WORD)?);
        let records_end = words.map(|words| at + head + u32::from(words) * WORD);
        Ok(match (generation, records_end) {
            (Some(generation), Some(records_end)) if self.is_end_of_records(records_end) => {
                Head::Whole { generation, records_end }
            }
            // Where each of them is programmed on its own, nothing comes after a torn generation.
            (None, _) => Head::Torn { end: at + 2 * unit },
            _ => Head::Torn { end: at + head },
        })
    }

    fn is_end_of_records(self, end: u32) -> bool {
        end.is_multiple_of(self.format.unit) && end + self.format.tail() <= self.size
    }

    /// Bytes for transactions in an empty page.
    pub(crate) fn room(self) -> u32 {
        self.size - self.format.first()
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
