//! The two pages of the parameter store as NOR flash; offset 0 is their start.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::chip::memory;
use crate::flash::controller::{Error, Flash};
use crate::flash::flash_area::FlashArea;
use crate::flash::sectors;
use crate::losses::{Event, Losses};
use crate::power::backup;

/// The flash controller, restricted to the sectors of the two pages.
pub struct ParameterFlash {
    flash: Flash,
    area: FlashArea,
    losses: &'static Losses,
}

impl ParameterFlash {
    pub(crate) fn new(flash: Flash, losses: &'static Losses) -> ParameterFlash {
        let pages = memory::parameters();
        ParameterFlash { flash, area: FlashArea::new(pages.start, pages), losses }
    }

    /// Reads from another area of the flash.
    pub(crate) fn read_in(&self, area: &FlashArea, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.flash.read(area, offset, bytes)
    }

    /// Programs in another area of the flash.
    pub(crate) fn write_in(&mut self, area: &FlashArea, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.admit()?;
        let written = self.flash.write(area, offset, bytes);
        self.noted(written)
    }

    /// Refuses a change while the supply is low.
    fn admit(&self) -> Result<(), Error> {
        if backup::is_supplied() {
            return Ok(());
        }
        self.losses.count(Event::Supply);
        Err(Error::Supply)
    }

    fn noted(&self, result: Result<(), Error>) -> Result<(), Error> {
        if result == Err(Error::Busy) {
            self.losses.count(Event::Flash);
        }
        result
    }
}

impl ErrorType for ParameterFlash {
    type Error = Error;
}

impl ReadNorFlash for ParameterFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.flash.read(&self.area, offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.area.capacity()
    }
}

impl NorFlash for ParameterFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = memory::PARAMETER_PAGE as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let len = to.checked_sub(from).ok_or(NorFlashErrorKind::OutOfBounds)?;
        let start = self.area.address(from, len as usize, memory::PARAMETER_PAGE)?;
        self.admit()?;
        for address in (start..start + len).step_by(Self::ERASE_SIZE) {
            let sector = sectors::starting_at(address).ok_or(NorFlashErrorKind::NotAligned)?;
            let erased = timed(|| self.flash.erase(sector.number));
            self.noted(erased)?;
        }
        self.flash.forget_cached();
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.admit()?;
        let written = self.flash.write(&self.area, offset, bytes);
        self.noted(written)
    }
}

/// Erases, and takes note of the time.
fn timed<R>(erase: impl FnOnce() -> R) -> R {
    #[cfg(feature = "development")]
    let begin = crate::Clock::now();
    let result = erase();
    #[cfg(feature = "development")]
    crate::chip::observations::note_erase(crate::Clock::now().0 - begin.0);
    result
}
