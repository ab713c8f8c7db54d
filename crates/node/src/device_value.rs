//! The first value of the parameter store: the device record, and behind it facts of the device that 1011h does not
//! affect: the log of updates, and the record about the retained state.
//!
//! | length | content |
//! |---|---|
//! | 4 | device record |
//! | 12 | device record, retained state: as programs without a log have stored it |
//! | 132 | device record, log |
//! | 140 | device record, log, retained state |
//!
//! A device record of zeros is not valid: the log does not turn the defaults of a new node into stored values.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use profiles::board::POSITION_RECORD_WORDS;
use storage::{Change, DeviceRecord, Error, Loaded, Store, View};
use update::{Event, Log};

/// The bytes of a device record.
pub(crate) type Device = [u8; DeviceRecord::LEN];
/// The bytes of the record about the retained state.
pub(crate) type Positions = [u8; 4 * POSITION_RECORD_WORDS];
type Bytes = [u8; DeviceRecord::ROOM];

/// The device record of a node that has stored none.
const NONE: Device = [0; DeviceRecord::LEN];
const WITH_LOG: usize = DeviceRecord::LEN + Log::LEN;
const WHOLE: usize = WITH_LOG + size_of::<Positions>();
const WITHOUT_LOG: usize = DeviceRecord::LEN + size_of::<Positions>();
const _: () = assert!(WHOLE <= DeviceRecord::ROOM);

/// The value.
#[derive(Debug)]
pub(crate) struct DeviceValue {
    pub(crate) device: Device,
    pub(crate) log: Log,
    pub(crate) positions: Option<Positions>,
}

impl DeviceValue {
    const EMPTY: DeviceValue = DeviceValue { device: NONE, log: Log::EMPTY, positions: None };

    /// The value as stored at the start.
    pub(crate) fn view<F: ReadNorFlash>(view: &mut View<F>) -> DeviceValue {
        let mut bytes: Bytes = [0; DeviceRecord::ROOM];
        let loaded = view.load(DeviceRecord::NUMBER, &mut bytes);
        DeviceValue::decode(&loaded, &bytes)
    }

    /// The value as stored now.
    pub(crate) fn read<F: NorFlash>(store: &mut Store<F>) -> DeviceValue {
        let mut bytes: Bytes = [0; DeviceRecord::ROOM];
        let loaded = store.load(DeviceRecord::NUMBER, &mut bytes);
        DeviceValue::decode(&loaded, &bytes)
    }

    /// Whether a device record is stored, valid or not.
    pub(crate) fn has_device(&self) -> bool {
        self.device != NONE
    }

    #[inline(never)]
    fn decode<E>(loaded: &Result<Option<Loaded>, Error<E>>, bytes: &Bytes) -> DeviceValue {
        let Ok(Some(Loaded { version: DeviceRecord::VERSION, len })) = loaded else {
            return DeviceValue::EMPTY;
        };
        let (device, rest) = bytes.split_first_chunk().unwrap_or((&NONE, &[]));
        let (log, positions) = match *len {
            WITH_LOG | WHOLE => rest.split_at_checked(Log::LEN).unwrap_or_default(),
            _ => (&[][..], rest),
        };
        let positions = positions.first_chunk().copied();
        let has_positions = matches!(*len, WITHOUT_LOG | WHOLE);
        DeviceValue {
            device: *device,
            log: Log::from_bytes(log),
            positions: positions.filter(|_| has_positions),
        }
    }

    /// Stores the value.
    #[inline(never)]
    pub(crate) fn save<F: NorFlash>(&self, store: &mut Store<F>) -> Result<(), Error<F::Error>> {
        let mut bytes: Bytes = [0; DeviceRecord::ROOM];
        let tail = self.positions.iter().flatten();
        let all = self.device.iter().chain(self.log.bytes()).chain(tail);
        bytes.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
        let len = if self.positions.is_some() { WHOLE } else { WITH_LOG };
        let value = bytes.get(..len).unwrap_or(&bytes);
        store.save(&[Change::Set { group: DeviceRecord::NUMBER, version: DeviceRecord::VERSION, value }])
    }
}

/// Replaces the device record, and keeps the bytes behind it.
pub(crate) fn replace_device<F: NorFlash>(
    device: Device,
    store: &mut Store<F>,
) -> Result<(), Error<F::Error>> {
    DeviceValue { device, ..DeviceValue::read(store) }.save(store)
}

/// The stored log of updates.
pub fn stored_log<F: NorFlash>(store: &mut Store<F>) -> Log {
    DeviceValue::read(store).log
}

/// Stores an event of an update.
///
/// # Errors
/// Errors of [`Store::save`].
pub fn log_event<F: NorFlash>(event: &Event, store: &mut Store<F>) -> Result<(), Error<F::Error>> {
    let mut value = DeviceValue::read(store);
    value.log.add(event);
    value.save(store)
}

#[cfg(test)]
mod tests {
    use storage::{Memory, Pages};
    use update::{Outcome, Version};

    use super::*;

    const PAGES: Pages = Pages::new(0, 4 * 1024);
    const EVENT: Event =
        Event { outcome: Outcome::OnTrial, version: Version { major: 1, minor: 2, patch: 3 }, generation: 0 };

    fn store(flash: &mut [u8]) -> Store<Memory<&mut [u8]>> {
        Store::prepare(View::open(Memory(flash), PAGES).unwrap()).unwrap()
    }

    #[test]
    fn a_log_makes_no_device_record_and_outlives_one() {
        let mut flash = [0xFF; 8 * 1024];
        log_event(&EVENT, &mut store(&mut flash)).unwrap();
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(view.device(), Ok(None));
        assert!(crate::Identity::read(&mut view).fault.is_none(), "a node without a record has no fault");
        replace_device([9, 1, 250, 0], &mut store(&mut flash)).unwrap();
        assert_eq!(stored_log(&mut store(&mut flash)).events().next(), Some(EVENT));
        let mut view = View::open(Memory(&flash[..]), PAGES).unwrap();
        assert_eq!(view.device().unwrap().unwrap().node_id(), 9);
    }

    #[test]
    fn values_of_programs_without_a_log_are_read() {
        for (value, positions) in [
            (&[5, 1, 250, 0][..], None),
            (&[5, 1, 250, 0, 1, 2, 3, 4, 5, 6, 7, 8], Some([1, 2, 3, 4, 5, 6, 7, 8])),
        ] {
            let mut flash = [0xFF; 8 * 1024];
            let mut store = store(&mut flash);
            let (group, version) = (DeviceRecord::NUMBER, DeviceRecord::VERSION);
            store.save(&[Change::Set { group, version, value }]).unwrap();
            let read = DeviceValue::read(&mut store);
            assert_eq!((read.device, read.positions), ([5, 1, 250, 0], positions));
            log_event(&EVENT, &mut store).unwrap();
            let read = DeviceValue::read(&mut store);
            assert_eq!((read.device, read.positions), ([5, 1, 250, 0], positions));
            assert_eq!(read.log.events().count(), 1);
        }
    }
}
