//! One pass over a page: which transactions it holds and what may follow.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::format::{CLEAN, KIND_VALUE, MARK, WORD};
use crate::group::{Group, Health, PerGroup};
use crate::page::{Page, Transaction};

/// Where a stored value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    pub(crate) page: Page,
    /// The transaction that holds it.
    pub(crate) transaction: u32,
    /// Its first byte.
    pub(crate) data: u32,
    pub(crate) version: u16,
    pub(crate) len: u32,
}

/// What the records say of a group; the last one counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Content {
    #[default]
    Unnamed,
    Restored,
    Value(Slot),
}

/// A group as read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entry {
    pub(crate) content: Content,
    /// A damaged transaction came later and may have named the group.
    pub(crate) suspect: bool,
}

impl Entry {
    pub(crate) fn health(&self) -> Health {
        match (self.suspect, self.content) {
            (false, _) => Health::Good,
            (true, Content::Unnamed) => Health::Lost,
            (true, _) => Health::FellBack,
        }
    }
}

/// The first transaction of a page, with which the page takes over from the other one. It names every group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum First {
    /// There is none, or it cannot be read.
    Missing,
    /// Complete but not closed: the power may have been cut at the commit word, which then reads well only by chance.
    Open,
    Closed,
}

/// A page as read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan {
    pub(crate) page: Page,
    /// Which use of a page this is, counted over both; `None` when it holds no complete transaction.
    pub(crate) generation: Option<u16>,
    pub(crate) first: First,
    /// The store has moved on to the other page.
    pub(crate) left: bool,
    /// Erased to the end and not written since.
    pub(crate) clean: bool,
    /// Nothing but closed transactions and erased words: the page may be appended to.
    pub(crate) tidy: bool,
    /// Where the last complete transaction ends.
    pub(crate) end: u32,
    pub(crate) groups: PerGroup<Entry>,
}

impl Scan {
    pub(crate) fn of<F: ReadNorFlash>(flash: &mut F, page: Page) -> Result<Scan, F::Error> {
        let mut scan = Scan {
            page,
            generation: None,
            first: First::Missing,
            left: page.word(flash, page.format.left_at())? == MARK,
            clean: page.word(flash, 0)? == CLEAN && page.erased_from(flash, page.format.unit)?,
            tidy: true,
            end: page.format.first(),
            groups: PerGroup::default(),
        };
        scan.transactions(flash)?;
        scan.rest(flash)?;
        Ok(scan)
    }

    /// Whether a transaction may be appended, if there is room.
    pub(crate) fn can_grow(&self) -> bool {
        self.tidy && !self.left
    }

    /// Takes every complete transaction. Transactions are contiguous, so one that does not begin where the last ended
    /// has something damaged before it.
    fn transactions<F: ReadNorFlash>(&mut self, flash: &mut F) -> Result<(), F::Error> {
        let mut at = self.page.format.first();
        while at < self.page.size {
            let Some(transaction) = self.page.transaction(flash, at)? else {
                at += self.page.format.unit;
                continue;
            };
            if at != self.end {
                self.damaged();
            }
            self.take(flash, &transaction)?;
            at = transaction.end;
        }
        Ok(())
    }

    fn take<F: ReadNorFlash>(&mut self, flash: &mut F, transaction: &Transaction) -> Result<(), F::Error> {
        self.generation = Some(transaction.generation);
        if transaction.at == self.page.format.first() {
            self.first = if transaction.closed { First::Closed } else { First::Open };
        }
        self.tidy &= transaction.closed;
        self.end = transaction.end;
        let format = self.page.format;
        let mut at = transaction.at + format.head();
        while at + format.record_head() <= transaction.records_end {
            at = self.take_record(flash, transaction, at)?;
        }
        Ok(())
    }

    /// Takes the record at `at` and returns where the next one is.
    fn take_record<F: ReadNorFlash>(
        &mut self,
        flash: &mut F,
        transaction: &Transaction,
        at: u32,
    ) -> Result<u32, F::Error> {
        let [id, kind, low, high] = self.page.word(flash, at)?.to_le_bytes();
        let len = self.page.word(flash, at + WORD)?;
        let (data, version) = (at + self.page.format.record_head(), u16::from_le_bytes([low, high]));
        if len > transaction.records_end - data {
            return Ok(transaction.records_end);
        }
        let slot = Slot { page: self.page, transaction: transaction.at, data, version, len };
        let content = if kind == KIND_VALUE { Content::Value(slot) } else { Content::Restored };
        if let Some(group) = Group::from_id(id) {
            *self.groups.get_mut(group) = Entry { content, suspect: false };
        }
        Ok(data + self.page.format.padded(len))
    }

    /// Judges what follows the last complete transaction: erased, a save that was cut, or damage.
    fn rest<F: ReadNorFlash>(&mut self, flash: &mut F) -> Result<(), F::Error> {
        if self.page.erased_from(flash, self.end)? {
            return Ok(());
        }
        self.tidy = false;
        let reach = self.page.reach_of_a_cut(flash, self.end)?;
        let foreign = self.generation.is_none() && self.page.word(flash, 0)? != CLEAN;
        if foreign || !self.page.erased_from(flash, reach)? {
            self.damaged();
        }
        Ok(())
    }

    /// Notes that a transaction at this place cannot be read: any group may have been in it.
    fn damaged(&mut self) {
        self.tidy = false;
        self.groups.iter_mut().for_each(|entry| entry.suspect = true);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::format::{Check, ERASED, Format, guarded};
    use crate::memory::Memory;

    const FORMAT: Format = Format::new(WORD).unwrap();

    /// A page of 64 bytes with one transaction of these records.
    fn scan(records: &[u32]) -> Scan {
        let len = u16::try_from(records.len()).unwrap();
        let mut words = [&[CLEAN, ERASED, MARK, guarded(1), guarded(len)], records].concat();
        let mut check = Check::new(FORMAT.first());
        for word in &words[3..] {
            check.add(*word);
        }
        words.extend([check.commit_word(), MARK]);
        words.resize(16, ERASED);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Scan::of(&mut Memory(bytes.as_slice()), Page { start: 0, size: 64, format: FORMAT }).unwrap()
    }

    fn head(group: Group) -> u32 {
        u32::from_le_bytes([group.id(), KIND_VALUE, 9, 0])
    }

    #[test]
    fn a_record_ends_where_its_transaction_ends_at_the_latest() {
        for (len, fits) in [(0, true), (1, true), (8, true), (9, false), (u32::MAX, false)] {
            let scan = scan(&[head(Group::Device), len, 0x1111, 0x2222]);
            let content = scan.groups.get(Group::Device).content;
            assert_eq!(matches!(content, Content::Value(slot) if slot.len == len), fits, "{len} bytes");
            assert!(scan.tidy);
        }
    }
}
