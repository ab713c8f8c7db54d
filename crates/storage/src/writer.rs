//! Programming one transaction, word after word.

use embedded_storage::nor_flash::NorFlash;

use crate::error::Error;
use crate::format::{
    Check, FIRST, HEAD, KIND_RESTORED, KIND_VALUE, MARK, RECORD_HEAD, TAIL, WORD, guarded, padded,
};
use crate::group::{Change, Group, PerGroup};
use crate::page::Page;
use crate::scan::{Content, Slot};

/// What a transaction will say of a group.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Record<'a> {
    Set { version: u16, value: &'a [u8] },
    Kept(Slot),
    Restored,
}

impl Record<'_> {
    fn len(&self) -> u32 {
        match self {
            Record::Set { value, .. } => u32::try_from(value.len()).unwrap_or(u32::MAX),
            Record::Kept(slot) => slot.len,
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
            Content::Value(slot) => Record::Kept(slot),
            Content::Restored | Content::Unnamed => Record::Restored,
        }
    }
}

/// The records of a transaction; groups without one stay as they are.
pub(crate) type Records<'a> = PerGroup<Option<Record<'a>>>;

/// Bytes that a transaction takes up. Values are at most [`crate::MAX_VALUE`] long.
pub(crate) fn size(records: &Records<'_>) -> u32 {
    let records = records.iter().filter_map(|(_, record)| record.as_ref());
    records.map(|record| RECORD_HEAD + padded(record.len())).sum::<u32>() + HEAD + TAIL
}

/// Where the next word goes.
pub(crate) struct Writer<'f, F> {
    flash: &'f mut F,
    page: Page,
    at: u32,
    check: Check,
}

impl<'f, F: NorFlash> Writer<'f, F> {
    pub(crate) fn new(flash: &'f mut F, page: Page, at: u32) -> Self {
        Writer { flash, page, at, check: Check::new(at) }
    }

    /// Programs a transaction. It counts from the commit word on; the closing mark after it says that the commit word
    /// is whole. The caller has made sure that it fits.
    pub(crate) fn transaction(
        &mut self,
        generation: u16,
        records: &Records<'_>,
    ) -> Result<(), Error<F::Error>> {
        let words = (size(records) - HEAD - TAIL) / WORD;
        let words = u16::try_from(words).map_err(|_| Error::TooLong)?;
        self.program(MARK)?;
        self.word(guarded(generation))?;
        self.word(guarded(words))?;
        for (group, record) in records.iter() {
            if let Some(record) = record {
                self.record(group, record)?;
            }
        }
        let check = core::mem::replace(&mut self.check, Check::new(FIRST));
        self.program(check.commit_word())?;
        self.program(MARK)
    }

    fn record(&mut self, group: Group, record: &Record<'_>) -> Result<(), Error<F::Error>> {
        let (kind, version) = match *record {
            Record::Set { version, .. } | Record::Kept(Slot { version, .. }) => (KIND_VALUE, version),
            Record::Restored => (KIND_RESTORED, 0),
        };
        let [low, high] = version.to_le_bytes();
        self.word(u32::from_le_bytes([group.id(), kind, low, high]))?;
        self.word(record.len())?;
        match *record {
            Record::Set { value, .. } => self.value(value),
            Record::Kept(slot) => self.copy(&slot),
            Record::Restored => Ok(()),
        }
    }

    /// The value and zeros up to a whole word.
    fn value(&mut self, value: &[u8]) -> Result<(), Error<F::Error>> {
        for chunk in value.chunks(WORD as usize) {
            let mut word = [0; WORD as usize];
            word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
            self.word(u32::from_le_bytes(word))?;
        }
        Ok(())
    }

    /// A value that is in flash already: no buffer is needed to move it.
    fn copy(&mut self, slot: &Slot) -> Result<(), Error<F::Error>> {
        for at in (slot.data..slot.data + padded(slot.len)).step_by(WORD as usize) {
            let word = slot.page.word(self.flash, at)?;
            self.word(word)?;
        }
        Ok(())
    }

    /// A word that the commit word vouches for.
    fn word(&mut self, word: u32) -> Result<(), Error<F::Error>> {
        self.check.add(word);
        self.program(word)
    }

    /// One word a call to the driver: between two calls the core runs whatever is due.
    pub(crate) fn program(&mut self, word: u32) -> Result<(), Error<F::Error>> {
        self.flash.write(self.page.start + self.at, &word.to_le_bytes())?;
        self.at += WORD;
        Ok(())
    }
}
