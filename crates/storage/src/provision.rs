//! Writes the device record of a new board, for the factory and for `cargo sim`.

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind};

use crate::device::DeviceRecord;
use crate::error::Error;
use crate::group::{Change, GroupNumber, Loaded};
use crate::memory::Memory;
use crate::page::Pages;
use crate::store::Store;
use crate::view::View;

/// Erases both pages, whatever their content, and stores a device record.
///
/// # Errors
/// Errors of [`View::open`], [`Store::prepare`] and [`Store::save`].
pub fn provision<F: NorFlash>(
    mut flash: F,
    pages: Pages,
    record: &DeviceRecord,
) -> Result<(), Error<F::Error>> {
    for page in pages.split::<F::Error>(flash.capacity(), F::ERASE_SIZE)? {
        flash.erase(page.start, page.start + page.size)?;
    }
    let mut store = Store::prepare(View::open(flash, pages)?)?;
    let value = &record.encode();
    store.save(&[Change::Set { group: DeviceRecord::NUMBER, version: DeviceRecord::VERSION, value }])
}

/// Reads one group from a dump of the flash. For several groups or their health use a [`View`] of a [`Memory`].
///
/// # Errors
/// Errors of [`View::open`] and [`View::load`].
pub fn read(
    flash: &[u8],
    pages: Pages,
    group: GroupNumber,
    buf: &mut [u8],
) -> Result<Option<Loaded>, Error<NorFlashErrorKind>> {
    View::open(Memory(flash), pages)?.load(group, buf)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGES: Pages = Pages::new(1024, 512);

    #[test]
    fn a_provisioned_flash_holds_the_record_and_nothing_else() {
        let record = DeviceRecord::new(5, 800, 2).unwrap();
        let mut flash = std::vec![0x55; 2048];
        provision(Memory(flash.as_mut_slice()), PAGES, &record).unwrap();
        assert!(flash[..1024].iter().all(|&byte| byte == 0x55), "only the pages are touched");
        let mut view = View::open(Memory(flash.as_slice()), PAGES).unwrap();
        assert_eq!(view.device(), Ok(Some(record)));
        let loaded = read(&flash, PAGES, DeviceRecord::NUMBER, &mut [0; 16]).unwrap();
        assert_eq!(loaded, Some(Loaded { version: DeviceRecord::VERSION, len: DeviceRecord::LEN }));
        assert_eq!(read(&flash, PAGES, GroupNumber::Three, &mut []), Ok(None));
    }

    #[test]
    fn pages_outside_the_flash_are_refused() {
        let record = DeviceRecord::new(5, 800, 2).unwrap();
        let mut flash = [0; 1024];
        for pages in
            [Pages::new(4, 512), Pages::new(u32::MAX - 3, 512), Pages::new(0, 32), Pages::new(2, 256)]
        {
            assert_eq!(provision(Memory(&mut flash[..]), pages, &record), Err(Error::Geometry));
            assert_eq!(View::open(Memory(&flash[..]), pages).err(), Some(Error::Geometry));
        }
        assert_eq!(flash, [0; 1024]);
    }
}
