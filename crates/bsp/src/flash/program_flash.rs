//! The flash that an update uses: the security counter and the revoked keys, the application with its header, and
//! staging.

use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};

use crate::chip::memory;
use crate::flash::controller::{Error, Flash};
use crate::flash::flash_area::FlashArea;
use crate::flash::sectors;

/// The flash controller, restricted to these sectors: the bootloader and the parameters cannot be reached. Offsets
/// count from the start of the flash.
pub struct ProgramFlash {
    flash: Flash,
    area: FlashArea,
    /// The part that may be erased.
    erasable: FlashArea,
    /// An erase was started, and its end has not been seen yet.
    erases: bool,
}

impl ProgramFlash {
    pub(crate) fn new(flash: Flash) -> ProgramFlash {
        let area = FlashArea::new(sectors::FLASH, memory::updatable());
        let erasable = FlashArea::new(sectors::FLASH, memory::erasable());
        ProgramFlash { flash, area, erasable, erases: false }
    }
}

impl ErrorType for ProgramFlash {
    type Error = Error;
}

impl ReadNorFlash for ProgramFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.flash.read_many(&self.area, offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.area.capacity()
    }
}

impl update::Flash for ProgramFlash {
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.flash.write(&self.area, offset, bytes)
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), Error> {
        let address = self.erasable.address(offset, 0, 4)?;
        let sector = sectors::starting_at(address).ok_or(NorFlashErrorKind::NotAligned)?;
        self.flash.start_erase(sector.number)?;
        self.erases = true;
        Ok(())
    }

    fn is_busy(&mut self) -> Result<bool, Error> {
        if self.flash.is_busy() {
            return Ok(true);
        }
        if core::mem::take(&mut self.erases) {
            self.flash.end()?;
            self.flash.forget_cached();
        }
        Ok(false)
    }
}
