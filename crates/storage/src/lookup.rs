//! The device record alone: for a bootloader, which has no room for the rest of the store.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::device::DeviceRecord;
use crate::format::WORD;
use crate::group::Group;
use crate::page::{Page, Pages, StoredRecord};
use crate::view::follows;

/// The device record that was saved last and is intact; `None` where there is none. Other groups are not looked at, and nothing
/// is said of damage: what a [`View`](crate::View) reads is the same where nothing is damaged.
///
/// Only what was saved to its end counts: its closing mark is there and its check is right.
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

/// The last record of the device in a page. A transaction names its groups in order, and the device is the first of them.
fn newest<F: ReadNorFlash>(flash: &mut F, page: Page) -> Option<StoredRecord> {
    let (mut at, mut newest) = (page.format.first(), None);
    while let Ok(Some((groups, end))) = page.head(flash, at) {
        if groups.contains(Group::Device) && matches!(page.is_closed(flash, end), Ok(true)) {
            let record = page.record(flash, at + page.format.head(), end).ok().flatten();
            newest = record.filter(|record| record.is_value_of(Group::Device)).or(newest);
        }
        at = end + page.format.tail();
    }
    newest
}
