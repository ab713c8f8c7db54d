//! One page as words, and its transactions.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::error::Error;
use crate::format::{Check, Contents, ERASED, Format, KIND_RESTORED, KIND_VALUE, MARK, WORD, in_words};
use crate::group::{GroupNumber, GroupSet};

/// The two pages of the store in the flash. Both have the same size and are adjacent.
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

    /// The same pages in a flash that programs `bytes` at once: 4, 8, 16 or 32, a multiple of its `WRITE_SIZE`.
    #[must_use]
    pub const fn with_words(self, bytes: u32) -> Pages {
        Pages { unit: bytes, ..self }
    }

    /// Whether a flash that programs `write_size` bytes at once can program the units of the store.
    pub(crate) fn suits(self, write_size: usize) -> bool {
        usize::try_from(self.unit).is_ok_and(|unit| unit.is_multiple_of(write_size))
    }

    /// The two pages, if a flash of `capacity` bytes that is erased in units of `erase_size` can hold them. The store
    /// accepts pages of 64 bytes to 128 KiB, in whole units.
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

/// One page. Places in the page are offsets from its beginning.
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
    pub(crate) records_end: u32,
    pub(crate) end: u32,
    pub(crate) closed: bool,
}

/// A record whose check word agrees with its content.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredRecord {
    /// `None` for a group that this version does not know.
    pub(crate) group: Option<GroupNumber>,
    pub(crate) kind: u8,
    pub(crate) version: u16,
    pub(crate) generation: u16,
    /// The place of the first byte of the value.
    pub(crate) data: u32,
    pub(crate) len: u32,
    /// The place of the next record.
    pub(crate) end: u32,
}

impl StoredRecord {
    /// Whether the record gives the group a value that is not empty.
    pub(crate) fn is_value_of(&self, group: GroupNumber) -> bool {
        self.group == Some(group) && self.kind == KIND_VALUE && self.len > 0
    }
}

impl Page {
    #[inline(never)] // Many callers, and little room in flash.
    pub(crate) fn word<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<u32, F::Error> {
        let mut bytes = [0; WORD as usize];
        flash.read(self.start + at, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Fills `buf` from a place at a word boundary.
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

    /// The transaction at `at`, if there is a complete one. The begin mark carries no information and is ignored.
    pub(crate) fn transaction<F: ReadNorFlash>(
        self,
        flash: &mut F,
        at: u32,
    ) -> Result<Option<Transaction>, F::Error> {
        let Some((_, records_end)) = self.head(flash, at)? else { return Ok(None) };
        let unit = self.format.unit;
        if self.check(flash, at, at + unit, records_end)? != self.word(flash, records_end)? {
            return Ok(None);
        }
        let closed = self.is_closed(flash, records_end)?;
        Ok(Some(Transaction { at, records_end, end: records_end + self.format.tail(), closed }))
    }

    /// The record at `at`, if there is an intact one that ends before `limit`. Its own check is enough, whatever the
    /// state of the transaction around it.
    pub(crate) fn record<F: ReadNorFlash>(
        self,
        flash: &mut F,
        at: u32,
        limit: u32,
    ) -> Result<Option<StoredRecord>, F::Error> {
        let data = at + self.format.record_head();
        if data >= limit {
            return Ok(None);
        }
        let [id, kind, low, high] = self.word(flash, at)?.to_le_bytes();
        let [len_low, len_high, generation_low, generation_high] = self.word(flash, at + WORD)?.to_le_bytes();
        let len = u32::from(u16::from_le_bytes([len_low, len_high]));
        let (check_at, end) = (data + in_words(len), data + self.format.body(len));
        let is_record = matches!(kind, KIND_VALUE | KIND_RESTORED) && end <= limit;
        if !is_record || self.check(flash, at, at, check_at)? != self.word(flash, check_at)? {
            return Ok(None);
        }
        let (version, generation) =
            (u16::from_le_bytes([low, high]), u16::from_le_bytes([generation_low, generation_high]));
        Ok(Some(StoredRecord { group: GroupNumber::from_id(id), kind, version, generation, data, len, end }))
    }

    /// The check word over the words between two places, for a record or transaction that begins at `at`.
    fn check<F: ReadNorFlash>(self, flash: &mut F, at: u32, from: u32, to: u32) -> Result<u32, F::Error> {
        let mut check = Check::new(at);
        for place in (from..to).step_by(WORD as usize) {
            check.add(self.word(flash, place)?);
        }
        Ok(check.commit_word())
    }

    /// Whether the transaction whose records end at `records_end` has its closing mark.
    pub(crate) fn is_closed<F: ReadNorFlash>(
        self,
        flash: &mut F,
        records_end: u32,
    ) -> Result<bool, F::Error> {
        Ok(self.word(flash, records_end + self.format.unit)? == MARK)
    }

    /// The end of the words that a save which began at `at` and was cut can have programmed. Words are programmed in
    /// order, so an incomplete head is followed by nothing, and a wrong commit word is not followed by a closing mark.
    pub(crate) fn reach_of_a_cut<F: ReadNorFlash>(self, flash: &mut F, at: u32) -> Result<u32, F::Error> {
        if !self.has_room_for_a_head(at) {
            return Ok(at);
        }
        let head = self.head(flash, at)?;
        Ok(head.map_or(at + self.format.head(), |(_, records_end)| records_end + self.format.unit))
    }

    /// The groups named by the transaction at `at`, and the end of its records; `None` for an incomplete head.
    pub(crate) fn head<F: ReadNorFlash>(
        self,
        flash: &mut F,
        at: u32,
    ) -> Result<Option<(GroupSet, u32)>, F::Error> {
        if !self.has_room_for_a_head(at) {
            return Ok(None);
        }
        let contents = Contents::of(self.word(flash, at + self.format.unit)?);
        let whole = contents
            .map(|Contents { words, groups }| (groups, at + self.format.head() + u32::from(words) * WORD));
        Ok(whole.filter(|(_, records_end)| self.is_end_of_records(*records_end)))
    }

    fn has_room_for_a_head(self, at: u32) -> bool {
        at + self.format.head() + self.format.tail() <= self.size
    }

    fn is_end_of_records(self, end: u32) -> bool {
        end.is_multiple_of(self.format.unit) && end + self.format.tail() <= self.size
    }

    /// Bytes for transactions in an empty page.
    pub(crate) fn room(self) -> u32 {
        self.size - self.format.first()
    }
}
