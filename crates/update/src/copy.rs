//! The copy of an image from one area to another. The header is written last, and its CRC at the end, so a copy that
//! was cut is not a valid image.

use core::ops::Range;

use crate::area::Area;
use crate::flash::{CHUNK, CHUNK_LEN, Flash, first, program};
use crate::header::{HEADER_LEN, Header};
use crate::image::{self, CrcCheck};
use crate::refusal::Refusal;

/// A copy: the image has been checked, and the destination is erased before the first step.
pub(crate) struct Copy {
    header: Header,
    to: Area,
    /// Distance of the source from the destination.
    distance: u32,
    /// Range of the destination that is not copied yet.
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

    /// Does one step; returns whether the copy is complete. Copies the code chunk by chunk, then checks the CRC of the
    /// copy in steps, then writes the header.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        if !self.rest.is_empty() {
            self.copy_chunk(flash)?;
        } else if self.crc.step(flash, &mut |_| ()).map_err(|_| Refusal::Write)? {
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
