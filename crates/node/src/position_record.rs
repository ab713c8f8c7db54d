//! Record about the retained state, which no object shows: the data about positions that a start with an empty battery
//! needs. It is stored behind the device record, in the same value.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use profiles::board::{POSITION_RECORD_WORDS, RETAINED_WORDS};
use profiles::encoder::PositionRecord;
use storage::{Error, Store, View};

use crate::device_value::{Device, DeviceValue, Positions};

/// Keeps the stored record up to date.
#[derive(Debug)]
pub struct StoredPositionRecord {
    /// The record as stored, or as it was when storing it last failed.
    stored: Option<PositionRecord>,
    /// The record at the start of this run.
    start: Option<PositionRecord>,
}

impl StoredPositionRecord {
    /// Continues from the result of [`read`](StoredPositionRecord::read).
    #[must_use]
    pub fn new(found: Option<[u32; POSITION_RECORD_WORDS]>) -> StoredPositionRecord {
        StoredPositionRecord { stored: found.map(PositionRecord::from_words), start: None }
    }

    /// The stored record; `None` if nothing is stored, or nothing that can be read.
    pub fn read<F: ReadNorFlash>(view: &mut View<F>) -> Option<[u32; POSITION_RECORD_WORDS]> {
        let positions = DeviceValue::view(view).positions?;
        let words: &[[u8; 4]; POSITION_RECORD_WORDS] = positions.as_chunks::<4>().0.try_into().ok()?;
        Some(words.map(u32::from_le_bytes))
    }

    /// Stores changes of the words that a profile retains when they are due: see [`PositionRecord::is_due`]. `device`
    /// is the device record, as stored or as it would be stored. Returns whether the store was written.
    ///
    /// # Errors
    /// Errors of [`Store::save`]. The next due time tries again.
    pub fn keep<F: NorFlash>(
        &mut self,
        retained: &[u32; RETAINED_WORDS],
        device: &Device,
        store: &mut Store<F>,
    ) -> Result<bool, Error<F::Error>> {
        let now = PositionRecord::of(retained);
        let start = *self.start.get_or_insert(now);
        if self.stored.is_some_and(|stored| !now.is_due(stored, start)) {
            return Ok(false);
        }
        self.stored = Some(now);
        let mut bytes: Positions = Default::default();
        for (to, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(now.to_words()) {
            *to = word.to_le_bytes();
        }
        let log = DeviceValue::read(store).log;
        DeviceValue { device: *device, log, positions: Some(bytes) }.save(store)?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_value::replace_device;
    use storage::{Memory, Pages};

    const PAGES: Pages = Pages::new(0, 4 * 1024);
    /// Node 5 at 250 kbit/s.
    const DEVICE: Device = [5, 1, 250, 0];

    /// The retained words of a profile with this operating time in tenths of an hour.
    fn retained(tenths: u32) -> [u32; RETAINED_WORDS] {
        let mut words = [0; RETAINED_WORDS];
        words[RETAINED_WORDS - 2] = tenths;
        words
    }

    #[test]
    fn the_first_start_leaves_a_record_and_the_next_ones_find_it() {
        let mut flash = [0xFF; 8 * 1024];
        let view = View::open(Memory(&mut flash[..]), PAGES).unwrap();
        let mut store = Store::prepare(view).unwrap();
        let mut record = StoredPositionRecord::new(None);
        assert!(record.keep(&retained(0), &DEVICE, &mut store).unwrap(), "at once");
        assert!(!record.keep(&retained(9), &DEVICE, &mut store).unwrap());
        assert!(record.keep(&retained(10), &DEVICE, &mut store).unwrap(), "an hour later");
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        let found = StoredPositionRecord::read(&mut view);
        assert_eq!(found, Some([10, 0]));
        assert_eq!(view.device().unwrap().unwrap().encode(), DEVICE, "the device is who it was");
        let mut store = Store::prepare(View::open(Memory(&mut flash[..]), PAGES).unwrap()).unwrap();
        assert!(!StoredPositionRecord::new(found).keep(&retained(10), &DEVICE, &mut store).unwrap());
    }

    #[test]
    fn another_node_id_leaves_it() {
        let mut flash = [0xFF; 8 * 1024];
        let mut store = Store::prepare(View::open(Memory(&mut flash[..]), PAGES).unwrap()).unwrap();
        replace_device(DEVICE, &mut store).unwrap();
        StoredPositionRecord::new(None).keep(&retained(7), &DEVICE, &mut store).unwrap();
        replace_device([9, 1, 250, 0], &mut store).unwrap();
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(StoredPositionRecord::read(&mut view), Some([7, 0]));
        assert_eq!(view.device().unwrap().unwrap().node_id(), 9);
    }

    #[test]
    fn flash_without_a_record_has_none() {
        let flash = [0xFF; 8 * 1024];
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(StoredPositionRecord::read(&mut view), None);
    }
}
