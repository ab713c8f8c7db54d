//! The record of the parameter store that nobody asks for: what a start without a battery has to know of the positions.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use profiles::board::{LASTING_WORDS, RETAINED_WORDS};
use profiles::encoder::Lasting;
use storage::{Change, Error, Group, Store, View};

/// Version of the record.
const VERSION: u16 = 1;
const LEN: usize = 4 * LASTING_WORDS;

/// Keeps the record up to date.
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

    /// What is stored; `None` where nothing is, or nothing that can be read.
    pub fn read<F: ReadNorFlash>(view: &mut View<F>) -> Option<[u32; LASTING_WORDS]> {
        let mut bytes = [0; LEN];
        let loaded = view.load(Group::Position, &mut bytes).ok()??;
        let (words, _) = bytes.as_chunks::<4>();
        let words: &[[u8; 4]; LASTING_WORDS] = words.try_into().ok()?;
        (loaded.version == VERSION && loaded.len == LEN).then(|| words.map(u32::from_le_bytes))
    }

    /// Stores what has changed in the words that a profile retains, when it is worth a write: see [`Lasting::is_due`].
    /// Whether it has written.
    ///
    /// # Errors
    /// As [`Store::save`]. It is tried again when it is due again.
    pub fn keep<F: NorFlash>(
        &mut self,
        retained: &[u32; RETAINED_WORDS],
        store: &mut Store<F>,
    ) -> Result<bool, Error<F::Error>> {
        let now = Lasting::of(retained);
        let start = *self.start.get_or_insert(now);
        if self.stored.is_some_and(|stored| !now.is_due(stored, start)) {
            return Ok(false);
        }
        self.stored = Some(now);
        let mut value = [0; LEN];
        for (bytes, word) in value.as_chunks_mut::<4>().0.iter_mut().zip(now.to_words()) {
            *bytes = word.to_le_bytes();
        }
        store.save(&[Change::Set { group: Group::Position, version: VERSION, value: &value }])?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use storage::{Memory, Pages};

    const PAGES: Pages = Pages::new(0, 16 * 1024);

    /// The words of a profile that has worked for so many tenths of an hour.
    fn retained(tenths: u32) -> [u32; RETAINED_WORDS] {
        let mut words = [0; RETAINED_WORDS];
        words[RETAINED_WORDS - 2] = tenths;
        words
    }

    #[test]
    fn the_first_start_leaves_a_record_and_the_next_ones_find_it() {
        let mut flash = [0xFF; 32 * 1024];
        let view = View::open(Memory(&mut flash[..]), PAGES).unwrap();
        let mut store = Store::prepare(view).unwrap();
        let mut record = LastingRecord::new(None);
        assert!(record.keep(&retained(0), &mut store).unwrap(), "at once");
        assert!(!record.keep(&retained(9), &mut store).unwrap());
        assert!(record.keep(&retained(10), &mut store).unwrap(), "an hour later");
        drop(store);
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        let found = LastingRecord::read(&mut view);
        assert_eq!(found, Some([10, 0]));
        let mut store = Store::prepare(View::open(Memory(&mut flash[..]), PAGES).unwrap()).unwrap();
        assert!(!LastingRecord::new(found).keep(&retained(10), &mut store).unwrap());
    }

    #[test]
    fn flash_without_a_record_has_none() {
        let flash = [0xFF; 32 * 1024];
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(LastingRecord::read(&mut view), None);
    }
}
