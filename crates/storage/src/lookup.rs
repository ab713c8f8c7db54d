//! Search for the device record alone, for a bootloader that has no room for the rest of the store.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::device::DeviceRecord;
use crate::format::WORD;
use crate::page::{Page, Pages, StoredRecord};
use crate::view::follows;

/// The device record that was saved last and is intact; `None` without one. Other groups are ignored, and damage is not
/// reported. Without damage the result is the same as that of a [`View`](crate::View).
///
/// After a cut in a save the result may be the new record while the store still reads the old one, until the next start
/// of the store.
pub fn device_record<F: ReadNorFlash>(flash: &mut F, pages: Pages) -> Option<DeviceRecord> {
    let [first, second] = pages.split::<F::Error>(flash.capacity(), WORD as usize).ok()?;
    let (a, b) = (newest(flash, first), newest(flash, second));
    let (page, record) = match (a, b) {
        (Some(a), Some(b)) if follows(b.generation, a.generation) => (second, b),
        (Some(a), _) => (first, a),
        (None, b) => (second, b?),
    };
    let mut value = [0; DeviceRecord::LEN];
    page.bytes(flash, record.data, &mut value).ok()?;
    DeviceRecord::decode(record.version, &value)
}

/// The last device record in a page. The check of each record includes its place, so a record found anywhere can be
/// trusted.
fn newest<F: ReadNorFlash>(flash: &mut F, page: Page) -> Option<StoredRecord> {
    let places = (page.format.first()..page.size).step_by(WORD as usize);
    let records = places.filter_map(|at| page.record(flash, at, page.size).ok().flatten());
    records.filter(|record| record.is_value_of(DeviceRecord::NUMBER)).last()
}
