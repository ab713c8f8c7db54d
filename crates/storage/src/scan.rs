//! One pass over a page: its transactions, and the place where the next one may follow.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::format::{CLEAN, KIND_VALUE, MARK};
use crate::group::{GroupSet, Health, PerGroup};
use crate::page::{Page, StoredRecord, Transaction};

/// The place of a stored value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    pub(crate) page: Page,
    /// The start of the record.
    pub(crate) record: u32,
    /// The first byte of the value.
    pub(crate) data: u32,
    pub(crate) version: u16,
    pub(crate) len: u32,
}

/// The content of a group after all records; the last record counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Content {
    #[default]
    Unnamed,
    Restored,
    Value(Slot),
}

/// A group as read from a page.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entry {
    pub(crate) content: Content,
    /// A later record is damaged, and belongs or may have belonged to this group.
    pub(crate) suspect: bool,
}

impl Entry {
    pub(crate) fn health(&self) -> Health {
        match (self.suspect, self.content) {
            (false, _) => Health::Good,
            (true, Content::Value(_)) => Health::FellBack,
            (true, _) => Health::Lost,
        }
    }
}

/// The first transaction of a page, with which the page takes over from the other page. It names every group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum First {
    /// The transaction does not exist or cannot be read.
    Missing,
    /// Complete but not closed: the power may have been cut at the commit word, which then reads well only by chance.
    Open,
    Closed,
}

/// The content of a page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan {
    pub(crate) page: Page,
    /// Number of this use of a page, counted over both pages; `None` if the page has no complete transaction.
    pub(crate) generation: Option<u16>,
    pub(crate) first: First,
    /// The store has moved on to the other page.
    pub(crate) left: bool,
    /// Fully erased, and not written since.
    pub(crate) clean: bool,
    /// The page has only closed transactions and erased words, so transactions may be appended.
    pub(crate) tidy: bool,
    /// The end of the last complete transaction.
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

    /// Takes every complete transaction. Transactions are contiguous, so a gap before one means damage.
    fn transactions<F: ReadNorFlash>(&mut self, flash: &mut F) -> Result<(), F::Error> {
        let mut at = self.page.format.first();
        while at < self.page.size {
            let Some(transaction) = self.page.transaction(flash, at)? else {
                at += self.page.format.unit;
                continue;
            };
            if at != self.end {
                self.salvage(flash, at)?;
                if at != self.end {
                    self.suspect(GroupSet::ALL);
                }
            }
            self.take(flash, &transaction)?;
            at = transaction.end;
        }
        Ok(())
    }

    /// Takes the next transaction, which is complete.
    pub(crate) fn take<F: ReadNorFlash>(
        &mut self,
        flash: &mut F,
        transaction: &Transaction,
    ) -> Result<(), F::Error> {
        if transaction.at == self.page.format.first() {
            self.first = if transaction.closed { First::Closed } else { First::Open };
        }
        self.tidy &= transaction.closed;
        self.end = transaction.end;
        self.records(flash, transaction.at + self.page.format.head(), transaction.records_end)?;
        Ok(())
    }

    /// Takes every intact record between two places, and returns their groups. Damaged parts are skipped unit by unit.
    fn records<F: ReadNorFlash>(&mut self, flash: &mut F, from: u32, to: u32) -> Result<GroupSet, F::Error> {
        let (mut at, mut found) = (from, GroupSet::NONE);
        while at < to {
            at = match self.page.record(flash, at, to)? {
                None => at + self.page.format.unit,
                Some(record) => {
                    self.take_record(at, &record, &mut found);
                    record.end
                }
            };
        }
        Ok(found)
    }

    fn take_record(&mut self, at: u32, record: &StoredRecord, found: &mut GroupSet) {
        self.generation = Some(record.generation);
        let &StoredRecord { kind, version, data, len, .. } = record;
        let slot = Slot { page: self.page, record: at, data, version, len };
        let content = if kind == KIND_VALUE { Content::Value(slot) } else { Content::Restored };
        if let Some(group) = record.group {
            found.insert(group);
            *self.groups.get_mut(group) = Entry { content, suspect: false };
        }
    }

    /// Judges the part after the last complete transaction: erased, a save that was cut, or damage.
    fn rest<F: ReadNorFlash>(&mut self, flash: &mut F) -> Result<(), F::Error> {
        if self.page.erased_from(flash, self.end)? {
            return Ok(());
        }
        self.salvage(flash, self.page.size)?;
        if self.generation.is_none() && self.page.word(flash, 0)? != CLEAN {
            self.suspect(GroupSet::ALL);
        }
        Ok(())
    }

    /// Takes the intact records of damaged transactions, from the end of the last transaction up to `to`. Stops at a
    /// save that was cut: its records do not count, and nothing is lost.
    fn salvage<F: ReadNorFlash>(&mut self, flash: &mut F, to: u32) -> Result<(), F::Error> {
        self.tidy = false;
        while self.end < to {
            let reach = self.page.reach_of_a_cut(flash, self.end)?;
            if self.page.erased_from(flash, reach)? {
                return Ok(());
            }
            let missing = match self.page.head(flash, self.end)? {
                Some((named, end)) if end + self.page.format.tail() <= to => {
                    self.salvage_named(flash, named, end)?
                }
                _ => self.salvage_unnamed(flash, to)?,
            };
            self.suspect(missing);
            if missing == GroupSet::ALL {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Takes a transaction with an intact head that names these groups. Returns the groups without an intact record.
    fn salvage_named<F: ReadNorFlash>(
        &mut self,
        flash: &mut F,
        named: GroupSet,
        records_end: u32,
    ) -> Result<GroupSet, F::Error> {
        let found = self.records(flash, self.end + self.page.format.head(), records_end)?;
        let missing = named.without(found);
        self.pass(records_end, missing);
        Ok(missing)
    }

    /// Takes a transaction with a damaged head. If its records follow each other up to a closing mark, nothing is
    /// missing; otherwise any group may have been in it.
    fn salvage_unnamed<F: ReadNorFlash>(&mut self, flash: &mut F, to: u32) -> Result<GroupSet, F::Error> {
        let first = self.end + self.page.format.head();
        let limit = to.saturating_sub(self.page.format.tail());
        let (mut at, mut found) = (first, GroupSet::NONE);
        while let Some(record) = self.page.record(flash, at, limit)? {
            self.take_record(at, &record, &mut found);
            at = record.end;
        }
        if at == first || !self.page.is_closed(flash, at)? {
            return Ok(GroupSet::ALL);
        }
        self.pass(at, GroupSet::NONE);
        Ok(GroupSet::NONE)
    }

    /// Continues after an incomplete transaction.
    fn pass(&mut self, records_end: u32, missing: GroupSet) {
        if self.end == self.page.format.first() && missing == GroupSet::NONE {
            self.first = First::Closed;
        }
        self.end = records_end + self.page.format.tail();
    }

    /// Takes note that the last saved values of these groups cannot be read.
    fn suspect(&mut self, groups: GroupSet) {
        let named = self.groups.iter_mut().filter(|(group, _)| groups.contains(*group));
        named.for_each(|(_, entry)| entry.suspect = true);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::format::{Check, Contents, ERASED, Format, WORD};
    use crate::group::GroupNumber;
    use crate::memory::Memory;

    const FORMAT: Format = Format::new(WORD).unwrap();

    /// A page of 64 bytes with one transaction of these words, which start with the head of a record.
    fn scan(words_of_record: &[u32]) -> Scan {
        let first = FORMAT.first();
        let mut record = Check::new(first + FORMAT.head());
        for word in words_of_record {
            record.add(*word);
        }
        let record = [words_of_record, &[record.commit_word()]].concat();
        let contents = Contents { words: u16::try_from(record.len()).unwrap(), groups: GroupSet(1) };
        let mut words = [&[CLEAN, ERASED, MARK, contents.word().unwrap()], &record[..]].concat();
        let mut check = Check::new(first);
        for word in &words[3..] {
            check.add(*word);
        }
        words.extend([check.commit_word(), MARK]);
        words.resize(16, ERASED);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Scan::of(&mut Memory(bytes.as_slice()), Page { start: 0, size: 64, format: FORMAT }).unwrap()
    }

    fn head(group: GroupNumber) -> u32 {
        u32::from_le_bytes([group.id(), KIND_VALUE, 9, 0])
    }

    #[test]
    fn a_record_ends_where_its_transaction_ends_at_the_latest() {
        // With five to eight bytes, the check word is where the test puts it.
        for (len, fits) in [(5, true), (8, true), (9, false), (0xFFFF, false)] {
            let scan = scan(&[head(GroupNumber::One), len, 0x1111, 0x2222]);
            let content = scan.groups.get(GroupNumber::One).content;
            assert_eq!(matches!(content, Content::Value(slot) if slot.len == len), fits, "{len} bytes");
            assert!(scan.tidy);
        }
    }
}
