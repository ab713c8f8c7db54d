//! Programs one transaction, word after word.

use embedded_storage::nor_flash::NorFlash;

use crate::error::Error;
use crate::format::{Check, Contents, Format, KIND_RESTORED, KIND_VALUE, LARGEST_UNIT, MARK, WORD, in_words};
use crate::group::{Change, GroupNumber, GroupSet, PerGroup};
use crate::page::Page;
use crate::scan::{Content, Slot};

/// The record of a group in a transaction.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Record<'a> {
    Set { version: u16, value: &'a [u8] },
    Existing(Slot),
    Restored,
}

impl Record<'_> {
    fn len(&self) -> u32 {
        match self {
            Record::Set { value, .. } => u32::try_from(value.len()).unwrap_or(u32::MAX),
            Record::Existing(slot) => slot.len,
            Record::Restored => 0,
        }
    }
}

impl<'a> From<Change<'a>> for Record<'a> {
    fn from(change: Change<'a>) -> Record<'a> {
        match change {
            Change::Set { version, value, .. } => Record::Set { version, value },
            Change::Restore(_) => Record::Restored,
        }
    }
}

impl From<Content> for Record<'_> {
    fn from(content: Content) -> Self {
        match content {
            Content::Value(slot) => Record::Existing(slot),
            Content::Restored | Content::Unnamed => Record::Restored,
        }
    }
}

/// The records of a transaction; groups without a record are unchanged.
pub(crate) type Records<'a> = PerGroup<Option<Record<'a>>>;

/// Size of a transaction in bytes. Values have at most [`crate::MAX_VALUE`] bytes.
pub(crate) fn size(records: &Records<'_>, format: Format) -> u32 {
    format.head() + records_size(records, format) + format.tail()
}

fn records_size(records: &Records<'_>, format: Format) -> u32 {
    let records = records.iter().filter_map(|(_, record)| record.as_ref());
    records.map(|record| format.record_head() + format.body(record.len())).sum()
}

/// Programs units at consecutive places.
pub(crate) struct Writer<'f, F> {
    flash: &'f mut F,
    page: Page,
    at: u32,
    /// Checksum of the transaction.
    check: Check,
    /// Checksum of the present record.
    record_check: Check,
    /// The words of an incomplete unit, followed by zeros.
    unit: [u8; LARGEST_UNIT as usize],
    filled: u32,
}

impl<'f, F: NorFlash> Writer<'f, F> {
    pub(crate) fn new(flash: &'f mut F, page: Page, at: u32) -> Self {
        let (check, record_check) = (Check::new(at), Check::new(at));
        Writer { flash, page, at, check, record_check, unit: [0; LARGEST_UNIT as usize], filled: 0 }
    }

    /// Programs a transaction. The transaction counts from the commit word on; the closing mark after the commit word
    /// proves that the commit word is complete. The caller has checked that the transaction fits.
    pub(crate) fn transaction(
        &mut self,
        generation: u16,
        records: &Records<'_>,
    ) -> Result<(), Error<F::Error>> {
        let words = records_size(records, self.page.format) / WORD;
        let words = u16::try_from(words).map_err(|_| Error::TooLong)?;
        let mut groups = GroupSet::NONE;
        let named = records.iter().filter(|(_, record)| record.is_some());
        named.for_each(|(group, _)| groups.insert(group));
        let contents = Contents { words, groups }.word().ok_or(Error::TooLong)?;
        self.program(MARK)?;
        self.word(contents)?;
        self.fill()?;
        for (group, record) in records.iter() {
            if let Some(record) = record {
                self.record(group, record, generation)?;
            }
        }
        let check = core::mem::replace(&mut self.check, Check::new(0));
        self.program(check.commit_word())?;
        self.program(MARK)
    }

    fn record(
        &mut self,
        group: GroupNumber,
        record: &Record<'_>,
        generation: u16,
    ) -> Result<(), Error<F::Error>> {
        let (kind, version) = match *record {
            Record::Set { version, .. } | Record::Existing(Slot { version, .. }) => (KIND_VALUE, version),
            Record::Restored => (KIND_RESTORED, 0),
        };
        self.record_check = Check::new(self.at);
        let [low, high] = version.to_le_bytes();
        self.word(u32::from_le_bytes([group.id(), kind, low, high]))?;
        let len = u16::try_from(record.len()).map_err(|_| Error::TooLong)?;
        self.word(u32::from(len) | u32::from(generation) << 16)?;
        self.fill()?;
        match *record {
            Record::Set { value, .. } => self.value(value)?,
            Record::Existing(slot) => self.copy(&slot)?,
            Record::Restored => {}
        }
        let check = core::mem::replace(&mut self.record_check, Check::new(0));
        self.word(check.commit_word())?;
        self.fill()
    }

    /// Writes the value, and zeros up to a whole word.
    fn value(&mut self, value: &[u8]) -> Result<(), Error<F::Error>> {
        for chunk in value.chunks(WORD as usize) {
            let mut word = [0; WORD as usize];
            word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
            self.word(u32::from_le_bytes(word))?;
        }
        Ok(())
    }

    /// Copies a value that is already in flash, so a move needs no buffer.
    fn copy(&mut self, slot: &Slot) -> Result<(), Error<F::Error>> {
        let end = slot.data + in_words(slot.len);
        for at in (slot.data..end).step_by(WORD as usize) {
            let word = slot.page.word(self.flash, at)?;
            self.word(word)?;
        }
        Ok(())
    }

    /// Writes zeros up to the end of the unit. The commit word covers them too.
    fn fill(&mut self) -> Result<(), Error<F::Error>> {
        while self.filled > 0 {
            self.word(0)?;
        }
        Ok(())
    }

    /// Writes a word that is covered by the check of the record and by the commit word.
    fn word(&mut self, word: u32) -> Result<(), Error<F::Error>> {
        self.check.add(word);
        self.record_check.add(word);
        self.put(word)
    }

    /// Writes a word in a unit of its own.
    pub(crate) fn program(&mut self, word: u32) -> Result<(), Error<F::Error>> {
        self.put(word)?;
        while self.filled > 0 {
            self.put(0)?;
        }
        Ok(())
    }

    /// Puts a word into the unit. One unit per call of the driver: between two calls the core runs other tasks that are
    /// due.
    fn put(&mut self, word: u32) -> Result<(), Error<F::Error>> {
        let place = self.unit.iter_mut().skip(self.filled as usize);
        place.zip(word.to_le_bytes()).for_each(|(to, byte)| *to = byte);
        self.filled += WORD;
        let size = self.page.format.unit;
        if self.filled < size {
            return Ok(());
        }
        self.filled = 0;
        let unit = self.unit.get(..size as usize).unwrap_or(&self.unit);
        self.flash.write(self.page.start + self.at, unit)?;
        self.at += size;
        Ok(())
    }
}
