//! Reading: the page in use, and its state of each group.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::device::DeviceRecord;
use crate::error::Error;
use crate::format::WORD;
use crate::group::{GroupNumber, Health, Loaded, PerGroup};
use crate::page::{Page, Pages};
use crate::scan::{Content, Entry, First, Scan, Slot};

/// The store for start-up code and host tools: read only.
#[derive(Debug)]
pub struct View<F> {
    pub(crate) flash: F,
    pub(crate) pages: Pages,
    pub(crate) state: State,
    health: PerGroup<Health>,
}

/// The state of the store, from both pages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    /// The page in use; no page is in use if its `generation` is `None`.
    pub(crate) current: Scan,
    pub(crate) other: Scan,
    pub(crate) groups: PerGroup<Entry>,
}

impl<F: ReadNorFlash> View<F> {
    /// Reads both pages. Nothing is written.
    ///
    /// # Errors
    /// [`Error::Geometry`] if the pages do not fit the flash, [`Error::Flash`] if the flash cannot be read. Damaged
    /// content of the pages is no error: see [`View::health`].
    pub fn open(mut flash: F, pages: Pages) -> Result<View<F>, Error<F::Error>> {
        const { assert!((WORD as usize).is_multiple_of(F::READ_SIZE), "the store reads words of 32 bits") };
        let state = State::read(&mut flash, pages)?;
        let health = PerGroup::from_fn(|group| state.groups.get(group).health());
        Ok(View { flash, pages, state, health })
    }

    /// Puts the value of a group at the beginning of `buf`; `None` if there is no value, so that the caller's defaults
    /// are in use. The CRC-32 of the value is checked again.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]; [`Error::Corrupt`] if the flash has changed since it was opened; [`Error::Flash`].
    /// After an error the content of `buf` is meaningless.
    pub fn load(&mut self, group: GroupNumber, buf: &mut [u8]) -> Result<Option<Loaded>, Error<F::Error>> {
        let Content::Value(slot) = self.state.groups.get(group).content else { return Ok(None) };
        let len = slot.len as usize;
        let target = buf.get_mut(..len).ok_or(Error::BufferTooSmall)?;
        self.verify(&slot)?;
        slot.page.bytes(&mut self.flash, slot.data, target)?;
        Ok(Some(Loaded { version: slot.version, len }))
    }

    /// The device record; `None` if none is stored or its layout is unknown to this program.
    ///
    /// # Errors
    /// Errors of [`View::load`].
    pub fn device(&mut self) -> Result<Option<DeviceRecord>, Error<F::Error>> {
        let mut buf = [0; DeviceRecord::ROOM];
        match self.load(DeviceRecord::NUMBER, &mut buf) {
            Ok(Some(loaded)) => {
                Ok(buf.get(..loaded.len).and_then(|value| DeviceRecord::decode(loaded.version, value)))
            }
            Ok(None) | Err(Error::BufferTooSmall) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Whether the newest values of a group could be read when the store was opened.
    #[must_use]
    pub fn health(&self, group: GroupNumber) -> Health {
        *self.health.get(group)
    }

    /// Returns the flash.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Checks the record of a value again.
    pub(crate) fn verify(&mut self, slot: &Slot) -> Result<(), Error<F::Error>> {
        if self.is_intact(slot)? { Ok(()) } else { Err(Error::Corrupt) }
    }

    fn is_intact(&mut self, slot: &Slot) -> Result<bool, F::Error> {
        Ok(slot.page.record(&mut self.flash, slot.record, slot.page.size)?.is_some())
    }

    /// Whether a stored value is intact and equal to these bytes.
    pub(crate) fn holds(&mut self, slot: &Slot, value: &[u8]) -> Result<bool, F::Error> {
        if slot.len as usize != value.len() || !self.is_intact(slot)? {
            return Ok(false);
        }
        let places = (slot.data..).step_by(WORD as usize);
        for (chunk, at) in value.chunks(WORD as usize).zip(places) {
            let word = slot.page.word(&mut self.flash, at)?.to_le_bytes();
            if !word.starts_with(chunk) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes the transaction that was appended at this place of the page in use. If it is not complete, the page is read
    /// again.
    pub(crate) fn take_appended(&mut self, at: u32) -> Result<(), Error<F::Error>> {
        let current = &mut self.state.current;
        let appended = current.page.transaction(&mut self.flash, at)?;
        match appended.filter(|appended| appended.closed && at == current.end) {
            Some(appended) => {
                current.take(&mut self.flash, &appended)?;
                self.state.merge();
                Ok(())
            }
            None => self.reread(self.state.current.page),
        }
    }

    /// Reads a page again after a write or an erase. The other page has not changed.
    pub(crate) fn reread(&mut self, page: Page) -> Result<(), Error<F::Error>> {
        let fresh = Scan::of(&mut self.flash, page)?;
        let State { current, other, .. } = self.state;
        let rest = if current.page == page { other } else { current };
        self.state =
            if page.start < rest.page.start { State::of(fresh, rest) } else { State::of(rest, fresh) };
        Ok(())
    }
}

impl State {
    fn read<F: ReadNorFlash>(flash: &mut F, pages: Pages) -> Result<State, Error<F::Error>> {
        let [first, second] = pages.split(flash.capacity(), WORD as usize)?;
        Ok(State::of(Scan::of(flash, first)?, Scan::of(flash, second)?))
    }

    /// The state from the first and the second page.
    fn of(first: Scan, second: Scan) -> State {
        let (current, other) = arrange(first, second);
        let mut state = State { current, other, groups: PerGroup::default() };
        state.merge();
        state
    }

    fn merge(&mut self) {
        self.groups = PerGroup::from_fn(|group| merge(&self.current, &self.other, group));
    }
}

/// The page in use first: the newer page, unless it cannot be relied on and the older page still exists. If none is in
/// use, the page that can take the first save comes second.
fn arrange(a: Scan, b: Scan) -> (Scan, Scan) {
    let (newer, older) = match (a.generation, b.generation) {
        (None, None) if a.clean => return (b, a),
        (_, None) => return (a, b),
        (None, _) => return (b, a),
        (Some(x), Some(y)) if follows(x, y) => (a, b),
        (Some(_), Some(_)) => (b, a),
    };
    let took_over = match newer.first {
        First::Closed => true,
        First::Open => older.left,
        First::Missing => false,
    };
    if took_over { (newer, older) } else { (older, newer) }
}

/// Whether generation `x` comes after `y`. The two are never far apart, so a wrap does not matter.
pub(crate) fn follows(x: u16, y: u16) -> bool {
    x.wrapping_sub(y).cast_signed() > 0
}

/// The state of a group. If the page in use is marked as left, its successor cannot be read. If no page is in use,
/// damage in either page may be the rest of a value.
fn merge(current: &Scan, other: &Scan, group: GroupNumber) -> Entry {
    let (mine, theirs) = (current.groups.get(group), other.groups.get(group));
    let successor_lost = current.left || (current.generation.is_none() && theirs.suspect);
    Entry { suspect: mine.suspect || successor_lost, ..*mine }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generations_are_ordered_across_the_wrap() {
        for x in [0, 1, 0x7FFF, 0x8000, u16::MAX] {
            assert!(follows(x.wrapping_add(1), x));
            assert!(!follows(x, x.wrapping_add(1)));
            assert!(!follows(x, x));
        }
    }
}
