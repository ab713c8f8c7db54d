//! The copy of an image from one area to another. The header comes last and its CRC last of all, so a copy that was cut is
//! no image.

use core::ops::Range;

use crate::area::Area;
use crate::flash::{CHUNK, CHUNK_LEN, Flash, first, program};
use crate::header::{HEADER_LEN, Header};
use crate::image::{self, CrcCheck};
use crate::refusal::Refusal;

/// A copy, about to begin or under way: the image is checked, and its new place is erased before the first step.
pub(crate) struct Copy {
    header: Header,
    to: Area,
    /// How far behind its new place the code is.
    distance: u32,
    /// Code that is not copied yet, in its new place.
    rest: Range<u32>,
    crc: CrcCheck,
}

impl Copy {
    /// The copy of the image with this header.
    pub(crate) fn new(header: Header, from: Area, to: Area) -> Copy {
        Copy {
            header,
            to,
            distance: from.start().wrapping_sub(to.start()),
            rest: image::code(&header, to),
            crc: CrcCheck::new(&header, to),
        }
    }

    /// Whether all is done: one chunk of code, then steps of the CRC of what was copied, then the header.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        if !self.rest.is_empty() {
            self.copy_chunk(flash)?;
        } else if self.crc.step(flash, |_| ()).map_err(|_| Refusal::Write)? {
            self.write_header(flash)?;
            return Ok(true);
        }
        Ok(false)
    }

    fn copy_chunk<F: Flash>(&mut self, flash: &mut F) -> Result<(), Refusal> {
        let Range { start, end } = self.rest;
        let mut buffer = [0; CHUNK];
        let chunk = first(&mut buffer, end.saturating_sub(start));
        flash.read(start.wrapping_add(self.distance), chunk).map_err(|_| Refusal::Unspecified)?;
        program(flash, start, chunk)?;
        self.rest.start = end.min(start.saturating_add(CHUNK_LEN));
        Ok(())
    }

    fn write_header<F: Flash>(&self, flash: &mut F) -> Result<(), Refusal> {
        const { assert!(HEADER_LEN == 2 * CHUNK, "two chunks") };
        let bytes = self.header.encode();
        let (start, end) = bytes.split_at(CHUNK);
        program(flash, self.to.start(), start)?;
        program(flash, self.to.start().saturating_add(CHUNK_LEN), end)
    }
}
