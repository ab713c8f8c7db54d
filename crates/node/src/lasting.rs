//! What the parameter store holds that nobody asks for: what a start without a battery has to know of the positions. It lies
//! behind the device record, in the same value: facts of the device, which no 1011h touches.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use profiles::board::{LASTING_WORDS, RETAINED_WORDS};
use profiles::encoder::Lasting;
use storage::{Change, DeviceRecord, Error, Loaded, Store, View};

/// The bytes of a device record.
type Device = [u8; DeviceRecord::LEN];
/// The bytes of a value of the group: the device record, and what lies behind it.
type Value = [u8; DeviceRecord::ROOM];

/// Bytes behind the device record.
const TAIL: usize = 4 * LASTING_WORDS;
const WHOLE: usize = DeviceRecord::LEN + TAIL;
const _: () = assert!(WHOLE <= DeviceRecord::ROOM);

/// Keeps it up to date.
#[derive(Debug)]
pub struct LastingRecord {
    /// As it is stored, or could not be.
    stored: Option<Lasting>,
    /// As this run has found it.
    start: Option<Lasting>,
}

impl LastingRecord {
    /// Goes on from what [`read`](LastingRecord::read) has found.
    #[must_use]
    pub fn new(found: Option<[u32; LASTING_WORDS]>) -> LastingRecord {
        LastingRecord { stored: found.map(Lasting::from_words), start: None }
    }

    /// The stored value; `None` where nothing is stored, or nothing that can be read.
    pub fn read<F: ReadNorFlash>(view: &mut View<F>) -> Option<[u32; LASTING_WORDS]> {
        let mut value: Value = [0; DeviceRecord::ROOM];
        let loaded = view.load(DeviceRecord::NUMBER, &mut value);
        let tail = tail(loaded, &value)?.as_chunks::<4>().0;
        let words: &[[u8; 4]; LASTING_WORDS] = tail.try_into().ok()?;
        Some(words.map(u32::from_le_bytes))
    }

    /// Stores what has changed in the words that a profile retains, when it is worth a write: see [`Lasting::is_due`].
    /// `device` is the device record as it is stored or would be. Whether it has written.
    ///
    /// # Errors
    /// Errors of [`Store::save`]. The next due time tries again.
    pub fn keep<F: NorFlash>(
        &mut self,
        retained: &[u32; RETAINED_WORDS],
        device: &Device,
        store: &mut Store<F>,
    ) -> Result<bool, Error<F::Error>> {
        let now = Lasting::of(retained);
        let start = *self.start.get_or_insert(now);
        if self.stored.is_some_and(|stored| !now.is_due(stored, start)) {
            return Ok(false);
        }
        self.stored = Some(now);
        let mut bytes = [0; TAIL];
        for (to, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(now.to_words()) {
            *to = word.to_le_bytes();
        }
        save(*device, &bytes, store)?;
        Ok(true)
    }
}

/// Replaces the device record, and leaves what lies behind it.
pub(crate) fn replace_device<F: NorFlash>(
    device: Device,
    store: &mut Store<F>,
) -> Result<(), Error<F::Error>> {
    let mut value: Value = [0; DeviceRecord::ROOM];
    let loaded = store.load(DeviceRecord::NUMBER, &mut value);
    save(device, tail(loaded, &value).unwrap_or_default(), store)
}

/// The bytes behind the device record.
fn tail<E>(loaded: Result<Option<Loaded>, Error<E>>, value: &Value) -> Option<&[u8]> {
    let loaded = loaded.ok()??;
    let is_whole = (loaded.version, loaded.len) == (DeviceRecord::VERSION, WHOLE);
    value.get(DeviceRecord::LEN..WHOLE).filter(|_| is_whole)
}

fn save<F: NorFlash>(device: Device, tail: &[u8], store: &mut Store<F>) -> Result<(), Error<F::Error>> {
    let mut value: Value = [0; DeviceRecord::ROOM];
    value.iter_mut().zip(device.iter().chain(tail)).for_each(|(to, from)| *to = *from);
    let value = value.get(..DeviceRecord::LEN + tail.len()).unwrap_or(&value);
    store.save(&[Change::Set { group: DeviceRecord::NUMBER, version: DeviceRecord::VERSION, value }])
}

#[cfg(test)]
mod tests {
    use super::*;
    use storage::{Memory, Pages};

    const PAGES: Pages = Pages::new(0, 4 * 1024);
    /// Node 5 at 250 kbit/s.
    const DEVICE: Device = [5, 1, 250, 0];

    /// The words of a profile that has worked for so many tenths of an hour.
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
        let mut record = LastingRecord::new(None);
        assert!(record.keep(&retained(0), &DEVICE, &mut store).unwrap(), "at once");
        assert!(!record.keep(&retained(9), &DEVICE, &mut store).unwrap());
        assert!(record.keep(&retained(10), &DEVICE, &mut store).unwrap(), "an hour later");
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        let found = LastingRecord::read(&mut view);
        assert_eq!(found, Some([10, 0]));
        assert_eq!(view.device().unwrap().unwrap().encode(), DEVICE, "the device is who it was");
        let mut store = Store::prepare(View::open(Memory(&mut flash[..]), PAGES).unwrap()).unwrap();
        assert!(!LastingRecord::new(found).keep(&retained(10), &DEVICE, &mut store).unwrap());
    }

    #[test]
    fn another_node_id_leaves_it() {
        let mut flash = [0xFF; 8 * 1024];
        let mut store = Store::prepare(View::open(Memory(&mut flash[..]), PAGES).unwrap()).unwrap();
        replace_device(DEVICE, &mut store).unwrap();
        LastingRecord::new(None).keep(&retained(7), &DEVICE, &mut store).unwrap();
        replace_device([9, 1, 250, 0], &mut store).unwrap();
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(LastingRecord::read(&mut view), Some([7, 0]));
        assert_eq!(view.device().unwrap().unwrap().node_id(), 9);
    }

    #[test]
    fn flash_without_a_record_has_none() {
        let flash = [0xFF; 8 * 1024];
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(LastingRecord::read(&mut view), None);
    }
}
