//! The download: bytes in order, any number at a time, programmed in chunks.

use crate::flash::{CHUNK, Flash, first, program};
use crate::header::{HEADER, Header};
use crate::image;
use crate::refusal::Refusal;
use crate::target::{Target, image_len};

/// A download in progress.
#[derive(Debug)]
pub(crate) struct Download {
    /// Number of bytes in flash.
    programmed: u32,
    /// Bytes of the incomplete chunk.
    held: [u8; CHUNK],
    count: usize,
    /// Total number of bytes, once the header is known.
    expected: Option<u32>,
}

impl Download {
    pub(crate) fn new() -> Download {
        Download { programmed: 0, held: [0xFF; CHUNK], count: 0, expected: None }
    }

    /// Number of bytes so far.
    pub(crate) fn received(&self) -> u32 {
        self.programmed.saturating_add(u32::try_from(self.count).unwrap_or(u32::MAX))
    }

    pub(crate) fn receive<F: Flash>(
        &mut self,
        flash: &mut F,
        target: &Target,
        bytes: &[u8],
    ) -> Result<(), Refusal> {
        for byte in bytes {
            if let Some(place) = self.held.get_mut(self.count) {
                *place = *byte;
                self.count = self.count.saturating_add(1);
            }
            if self.count == CHUNK {
                self.flush(flash, target)?;
            }
        }
        if self.expected.is_some_and(|expected| self.received() > expected) {
            return Err(Refusal::Excess);
        }
        Ok(())
    }

    /// Ends the download: programs the rest.
    pub(crate) fn finish<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<(), Refusal> {
        match self.expected {
            Some(expected) if self.received() >= expected => self.flush(flash, target),
            _ => Err(Refusal::Truncated),
        }
    }

    fn flush<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<(), Refusal> {
        let staging = target.layout.staging();
        let len = u32::try_from(self.count.next_multiple_of(4)).unwrap_or(u32::MAX);
        if self.programmed.saturating_add(len) > target.layout.longest_image() {
            return Err(Refusal::Excess);
        }
        let at = staging.start().saturating_add(self.programmed);
        program(flash, at, first(&mut self.held, len))?;
        self.programmed = self.programmed.saturating_add(len);
        (self.held, self.count) = ([0xFF; CHUNK], 0);
        self.look_at_header(flash, target)
    }

    /// Checks the header as soon as it is complete, so that a wrong header is refused at once and not after minutes.
    fn look_at_header<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<(), Refusal> {
        if self.expected.is_none() && self.programmed >= HEADER {
            let mut header = Header::EMPTY;
            image::candidate(flash, target, &mut header)?;
            self.expected = Some(image_len(&header));
        }
        Ok(())
    }
}
