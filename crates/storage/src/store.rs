//! Saving: transactions, the move to the other page, and the erase of the page that is not in use.

use embedded_storage::nor_flash::NorFlash;

use crate::device::DeviceRecord;
use crate::error::Error;
use crate::format::{CLEAN, Format, MARK};
use crate::group::{Change, GroupNumber, Health, Loaded, PerGroup};
use crate::page::Page;
#[cfg(doc)]
use crate::page::Pages;
use crate::scan::{Content, Scan};
use crate::view::View;
use crate::writer::{Record, Records, Writer, size};

/// The longest value of a group in bytes. Four of them fit a page of 16 KiB.
pub const MAX_VALUE: usize = 2048;

/// The parameter store. It has one owner; every call leaves the flash in a state that survives a power cut.
#[derive(Debug)]
pub struct Store<F> {
    view: View<F>,
    erases: u32,
}

impl<F: NorFlash> Store<F> {
    /// The flash, for access outside of the pages.
    pub fn flash(&mut self) -> &mut F {
        &mut self.view.flash
    }

    /// Makes the store ready for saving, with as many erases as it needs: see [`prepare_within`](Store::prepare_within).
    ///
    /// # Errors
    /// Errors of [`prepare_within`](Store::prepare_within).
    pub fn prepare(view: View<F>) -> Result<Store<F>, Error<F::Error>> {
        Store::prepare_within(view, u32::MAX)
    }

    /// Makes the store ready for saving with at most this many erases: erases the page that is not in use, unless it is
    /// erased already. If the page in use was cut or damaged, its readable data is first moved to the other page.
    /// Nothing is therefore ever appended to doubtful words, and the values read at this start are final. If `erases` is too
    /// small, the store can be [full](Error::Full) until [`make_room`](Store::make_room).
    ///
    /// To be called at start-up, before the node joins the bus: an erase of 16 KiB stops a single-bank flash for
    /// 0.25 s, and there can be two. Most starts erase nothing.
    ///
    /// # Errors
    /// [`Error::Flash`]; [`Error::Corrupt`] if a page cannot be erased or programmed; [`Error::Geometry`] if the flash
    /// cannot erase the pages separately, or programs other words than [`Pages`] says.
    pub fn prepare_within(view: View<F>, erases: u32) -> Result<Store<F>, Error<F::Error>> {
        if !view.pages.suits(F::WRITE_SIZE) {
            return Err(Error::Geometry);
        }
        view.pages.split::<F::Error>(view.flash.capacity(), F::ERASE_SIZE)?;
        let mut store = Store { view, erases: 0 };
        store.leave_doubtful()?;
        while store.erases < erases && store.needs_room() {
            store.make_room()?;
        }
        Ok(store)
    }

    /// Whether a page that is not in use has to be erased before it can be used again.
    #[must_use]
    pub fn needs_room(&self) -> bool {
        self.used_up().is_some()
    }

    /// Erases a page that is not in use, if there is one to be erased: see [`needs_room`](Store::needs_room). Stops a
    /// single-bank flash for 0.25 s, 0.5 s at most (16 KiB).
    ///
    /// # Errors
    /// [`Error::Flash`]; [`Error::Corrupt`] if a page cannot be erased or programmed.
    pub fn make_room(&mut self) -> Result<(), Error<F::Error>> {
        if let Some(page) = self.used_up() {
            self.erase(page)?;
        }
        self.leave_doubtful()
    }

    /// Number of erases since [`prepare`](Store::prepare).
    #[must_use]
    pub fn erases(&self) -> u32 {
        self.erases
    }

    /// How often the store has moved to the other page, since the pages were new. Counted in the pages themselves, modulo
    /// 65,536. Every move costs one erase, so each of the two pages has been erased half as often.
    #[must_use]
    pub fn moves(&self) -> u16 {
        self.current().generation.unwrap_or(0)
    }

    /// Number of saves that certainly succeed before [`make_room`](Store::make_room), if the values have at most these
    /// lengths in bytes, group by group, and if each save changes all groups. Saves of fewer or shorter values cost less.
    /// Each is counted with a save of the first group alone beside it, the device record.
    #[must_use]
    pub fn saves_left(&self, longest: &[usize; 4]) -> u32 {
        let format = self.format();
        let frame = format.head() + format.tail();
        let record =
            |len: &usize| format.record_head() + format.body(u32::try_from(*len).unwrap_or(u32::MAX));
        let [device, ..] = longest;
        let whole = frame + longest.iter().map(record).sum::<u32>();
        let cost = whole + frame + record(device);
        let fits = |room: u32| room.checked_div(cost).unwrap_or(0);
        let Scan { page, end, generation, .. } = *self.current();
        let here =
            if generation.is_some() && self.current().can_grow() { page.size.saturating_sub(end) } else { 0 };
        // The first transaction of a page has all groups, whatever its save changes.
        let there = if self.other().clean { page.room().saturating_sub(whole) } else { 0 };
        fits(here) + fits(there)
    }

    /// The page that is not in use, unless it is clean.
    fn used_up(&self) -> Option<Page> {
        let pages = [self.current().page, self.other().page];
        pages.into_iter().find(|page| self.is_spare(*page) && !self.is_clean(*page))
    }

    /// Moves away from a page that was cut or damaged, if the other page is clean.
    fn leave_doubtful(&mut self) -> Result<(), Error<F::Error>> {
        let is_doubtful = self.current().generation.is_some() && !self.current().can_grow();
        if is_doubtful && self.other().clean { self.move_on(&self.existing()) } else { Ok(()) }
    }

    /// Makes all `changes` or none. The last of several changes to one group counts; values that are already stored are
    /// not written again. Only programs words, about 16 us each, and never erases.
    ///
    /// # Errors
    /// [`Error::TooLong`] and [`Error::Full`]: nothing was changed. [`Error::Flash`] and [`Error::Corrupt`]:
    /// the flash has failed; [`Store::load`] returns the state of the groups, all old or all new.
    pub fn save(&mut self, changes: &[Change<'_>]) -> Result<(), Error<F::Error>> {
        if changes.is_empty() {
            return Ok(());
        }
        let too_long =
            |change: &Change<'_>| matches!(change, Change::Set { value, .. } if value.len() > MAX_VALUE);
        let mut new = PerGroup::from_fn(|group| last_change(changes, group));
        let whole = PerGroup::from_fn(|group| new.get(group).or(*self.existing().get(group)));
        // A value that does not fit a page alone could never be moved, so it is refused although there is still room
        // for it.
        if changes.iter().any(too_long) || size(&whole, self.format()) > self.current().page.room() {
            return Err(Error::TooLong);
        }
        self.drop_unchanged(&mut new)?;
        if new.iter().all(|(_, record)| record.is_none()) {
            return Ok(());
        }
        if self.can_append(size(&new, self.format())) {
            self.append(&new)
        } else if self.other().clean {
            self.move_on(&whole)
        } else {
            Err(Error::Full)
        }
    }

    /// Removes values that are already stored: a master that saves after every start does not wear the flash.
    fn drop_unchanged(&mut self, records: &mut Records<'_>) -> Result<(), F::Error> {
        for group in GroupNumber::ALL {
            let is_same = match (records.get(group), self.current_content(group)) {
                (Some(Record::Set { version, value }), Content::Value(slot)) if slot.version == *version => {
                    self.view.holds(&slot, value)?
                }
                (Some(Record::Restored), Content::Restored) => true,
                _ => false,
            };
            if is_same {
                *records.get_mut(group) = None;
            }
        }
        Ok(())
    }

    /// The content of the group that the next start would read. Values in a damaged page do not count, because the page
    /// will be rewritten.
    fn current_content(&self, group: GroupNumber) -> Content {
        let entry = self.view.state.groups.get(group);
        if entry.suspect { Content::Unnamed } else { entry.content }
    }

    /// Loads a group: see [`View::load`].
    ///
    /// # Errors
    /// Errors of [`View::load`].
    pub fn load(&mut self, group: GroupNumber, buf: &mut [u8]) -> Result<Option<Loaded>, Error<F::Error>> {
        self.view.load(group, buf)
    }

    /// Loads the device record: see [`View::device`].
    ///
    /// # Errors
    /// Errors of [`View::load`].
    pub fn device(&mut self) -> Result<Option<DeviceRecord>, Error<F::Error>> {
        self.view.device()
    }

    /// The [`View::health`] at the opening of the view, even after `prepare` has repaired the store.
    #[must_use]
    pub fn health(&self, group: GroupNumber) -> Health {
        self.view.health(group)
    }

    /// Returns the flash.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.view.into_flash()
    }

    fn format(&self) -> Format {
        self.current().page.format
    }

    fn current(&self) -> &Scan {
        &self.view.state.current
    }

    fn other(&self) -> &Scan {
        &self.view.state.other
    }

    fn is_spare(&self, page: Page) -> bool {
        self.current().page != page || self.current().generation.is_none()
    }

    fn is_clean(&self, page: Page) -> bool {
        [self.current(), self.other()].into_iter().any(|scan| scan.page == page && scan.clean)
    }

    /// A record of the present state of every group.
    fn existing(&self) -> Records<'static> {
        PerGroup::from_fn(|group| Some(Record::from(self.view.state.groups.get(group).content)))
    }

    fn can_append(&self, size: u32) -> bool {
        let scan = self.current();
        scan.generation.is_some() && scan.can_grow() && scan.end + size <= scan.page.size
    }

    fn append(&mut self, records: &Records<'_>) -> Result<(), Error<F::Error>> {
        let Scan { page, end, generation, .. } = *self.current();
        self.write(page, end, generation.unwrap_or(0), records)
    }

    /// Writes the records, which name every group, as the first transaction of the other page. From its commit on, that
    /// page is in use.
    fn move_on(&mut self, records: &Records<'_>) -> Result<(), Error<F::Error>> {
        self.verify_existing(records)?;
        let old = *self.current();
        let generation = old.generation.map_or(0, |generation| generation.wrapping_add(1));
        self.write(self.other().page, self.format().first(), generation, records)?;
        if old.generation.is_none() || old.left {
            return Ok(());
        }
        Writer::new(&mut self.view.flash, old.page, old.page.format.left_at()).program(MARK)
    }

    /// Checks values again before they are copied: a value that has decayed since it was read must not get a new CRC.
    fn verify_existing(&mut self, records: &Records<'_>) -> Result<(), Error<F::Error>> {
        for (_, record) in records.iter() {
            if let Some(Record::Existing(slot)) = record {
                self.view.verify(slot)?;
            }
        }
        Ok(())
    }

    /// Writes a transaction, then reads it again, so that the state in RAM always agrees with the flash. A page that comes
    /// into use, and a page after an error, are read as a whole.
    fn write(
        &mut self,
        page: Page,
        at: u32,
        generation: u16,
        records: &Records<'_>,
    ) -> Result<(), Error<F::Error>> {
        let written = Writer::new(&mut self.view.flash, page, at).transaction(generation, records);
        if written.is_ok() && page == self.current().page {
            self.view.take_appended(at)?;
        } else {
            self.view.reread(page)?;
        }
        written?;
        let Scan { page: current, end, tidy, .. } = *self.current();
        if current == page && end == at + size(records, page.format) && tidy {
            Ok(())
        } else {
            Err(Error::Corrupt)
        }
    }

    /// Erases a page and marks it clean; without the mark the erase may have been cut.
    fn erase(&mut self, page: Page) -> Result<(), Error<F::Error>> {
        self.erases = self.erases.saturating_add(1);
        self.view.flash.erase(page.start, page.start + page.size)?;
        Writer::new(&mut self.view.flash, page, 0).program(CLEAN)?;
        self.view.reread(page)?;
        if self.is_clean(page) { Ok(()) } else { Err(Error::Corrupt) }
    }
}

fn last_change<'a>(changes: &[Change<'a>], group: GroupNumber) -> Option<Record<'a>> {
    changes.iter().rev().find(|change| change.group() == group).map(|&change| Record::from(change))
}
