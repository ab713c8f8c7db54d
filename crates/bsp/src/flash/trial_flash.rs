//! Access of the application to the records of an update, to confirm itself or to be rolled back.

use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};
use update::Trial;

use crate::ParameterFlash;
use crate::flash::controller::Error;
use crate::flash::flash_area::FlashArea;
use crate::flash::sectors;
use crate::flash::update_layout::LAYOUT;

/// Read access to all areas of an update. Only the last bytes of staging and of the kept image can be programmed, and
/// nothing can be erased.
pub struct TrialFlash<'a>(&'a mut ParameterFlash);

impl ParameterFlash {
    /// The records of an update.
    pub fn trial(&mut self) -> TrialFlash<'_> {
        TrialFlash(self)
    }
}

/// The record that contains `offset`.
fn record(offset: u32) -> Result<FlashArea, Error> {
    let record = Trial::records(&LAYOUT).into_iter().find(|record| record.contains(&offset));
    let record = record.ok_or(NorFlashErrorKind::OutOfBounds)?;
    Ok(FlashArea::new(sectors::FLASH, sectors::FLASH + record.start..sectors::FLASH + record.end))
}

impl ErrorType for TrialFlash<'_> {
    type Error = Error;
}

impl ReadNorFlash for TrialFlash<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.0.read_in(
            &FlashArea::new(sectors::FLASH, sectors::FLASH..sectors::FLASH + LAYOUT.kept().end()),
            offset,
            bytes,
        )
    }

    fn capacity(&self) -> usize {
        LAYOUT.kept().end() as usize
    }
}

impl update::Flash for TrialFlash<'_> {
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.0.write_in(&record(offset)?, offset, bytes)
    }

    /// Always refused.
    fn start_erase(&mut self, _: u32) -> Result<(), Error> {
        Err(NorFlashErrorKind::OutOfBounds.into())
    }

    fn is_busy(&mut self) -> Result<bool, Error> {
        Ok(false)
    }
}
