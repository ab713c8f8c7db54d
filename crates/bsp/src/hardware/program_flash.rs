//! The flash that an update works on: the application with its header, and staging.

use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};

use super::flash::{Error, Flash};
use super::memory;
use crate::sectors;

/// The controller for those sectors; the bootloader and the parameters cannot be reached with it. Offsets count from the
/// start of the flash.
pub struct ProgramFlash {
    flash: Flash,
    /// An erase was begun whose end nobody has seen.
    erases: bool,
}

impl ProgramFlash {
    pub(super) fn new(flash: Flash) -> ProgramFlash {
        ProgramFlash { flash, erases: false }
    }

    /// The address of a span that lies in those sectors and starts at a multiple of `boundary`.
    fn address(offset: u32, len: usize, boundary: u32) -> Result<u32, Error> {
        let area = memory::updatable();
        let out_of_bounds = Error::Place(NorFlashErrorKind::OutOfBounds);
        let start = sectors::FLASH.checked_add(offset).filter(|start| *start >= area.start);
        let start = start.ok_or(out_of_bounds)?;
        let end = u32::try_from(len).ok().and_then(|len| start.checked_add(len));
        end.filter(|&end| end <= area.end).ok_or(out_of_bounds)?;
        if start.is_multiple_of(boundary) {
            Ok(start)
        } else {
            Err(Error::Place(NorFlashErrorKind::NotAligned))
        }
    }
}

impl ErrorType for ProgramFlash {
    type Error = Error;
}

impl ReadNorFlash for ProgramFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let address = Self::address(offset, bytes.len(), 1)?;
        // SAFETY: `address` has checked that all of it lies in flash, which is readable for ever, and nobody programs it
        // meanwhile, as that takes this value too.
        let area = unsafe { core::slice::from_raw_parts(address as *const u8, bytes.len()) };
        bytes.copy_from_slice(area);
        Ok(())
    }

    fn capacity(&self) -> usize {
        (memory::updatable().end - sectors::FLASH) as usize
    }
}

impl update::Flash for ProgramFlash {
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let address = Self::address(offset, bytes.len(), 4)?;
        let (words, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(Error::Place(NorFlashErrorKind::NotAligned));
        }
        for (word, place) in words.iter().zip((address..).step_by(4)) {
            self.flash.program(place, u32::from_le_bytes(*word))?;
        }
        self.flash.forget_cached();
        Ok(())
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), Error> {
        let address = Self::address(offset, 0, 4)?;
        let sector = sectors::starting_at(address).ok_or(Error::Place(NorFlashErrorKind::NotAligned))?;
        self.flash.start_erase(sector.number);
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
