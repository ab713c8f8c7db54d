//! The copy of an image from one area to another. The destination is erased first. The header is written last, and its
//! CRC at the end, so a copy that was cut is not a valid image.

use core::ops::Range;

use crate::area::Area;
use crate::erase::Erase;
use crate::flash::{CHUNK, CHUNK_LEN, Flash, first, program};
use crate::header::{HEADER_LEN, Header};
use crate::image::{self, CrcCheck};
use crate::refusal::Refusal;

/// A copy of an image that was checked.
pub(crate) struct Copy {
    erase: Erase,
    is_erased: bool,
    to: u32,
    /// Distance of the source from the destination.
    distance: u32,
    /// Range of the destination that is not copied yet.
    rest: Range<u32>,
    crc: CrcCheck,
}

impl Copy {
    /// The copy of the image with this header.
    pub(crate) fn new(header: &Header, from: Area, to: Area) -> Copy {
        Copy {
            erase: Erase::new(to),
            is_erased: false,
            to: to.start(),
            distance: from.start().wrapping_sub(to.start()),
            rest: image::code(header, to),
            crc: CrcCheck::new(header, to),
        }
    }

    /// Whether the flash was erasing at the last step.
    pub(crate) fn is_erasing(&self) -> bool {
        self.erase.is_at_work()
    }

    /// Does one step; returns whether the copy is complete. Erases the destination, copies the code chunk by chunk, then
    /// checks the CRC of the copy in steps, then copies the header.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        if !self.is_erased {
            self.is_erased = self.erase.step(flash)?;
        } else if !self.rest.is_empty() {
            let Range { start, end } = self.rest;
            self.copy(flash, start, end.saturating_sub(start))?;
            self.rest.start = end.min(start.saturating_add(CHUNK_LEN));
        } else if self.crc.step(flash, &mut None).map_err(|_| Refusal::Write)? {
            const { assert!(HEADER_LEN == 2 * CHUNK, "two chunks") };
            self.copy(flash, self.to, CHUNK_LEN)?;
            self.copy(flash, self.to.saturating_add(CHUNK_LEN), CHUNK_LEN)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// Copies at most a chunk to `start`.
    fn copy<F: Flash>(&self, flash: &mut F, start: u32, len: u32) -> Result<(), Refusal> {
        let mut buffer = [0; CHUNK];
        let chunk = first(&mut buffer, len);
        flash.read(start.wrapping_add(self.distance), chunk).map_err(|_| Refusal::Unspecified)?;
        program(flash, start, chunk)
    }
}
