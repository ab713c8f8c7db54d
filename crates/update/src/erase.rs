//! The erase of an area, sector by sector, with a check that the area is erased.

use core::ops::Range;

use crate::area::Area;
use crate::flash::{CHUNK, Flash, PIECES, all_are, read_piece};
use crate::refusal::Refusal;

/// An erase in progress.
#[derive(Clone, Debug)]
pub(crate) struct Erase {
    /// Sizes of the sectors whose erase was not begun, and the start of the first one.
    sectors: &'static [u32],
    next: u32,
    at_work: bool,
    /// Range that has not been checked yet.
    rest: Range<u32>,
}

impl Erase {
    pub(crate) fn new(area: Area) -> Erase {
        let (next, sectors) = (area.start(), area.sizes());
        Erase { sectors, next, at_work: false, rest: next..area.end() }
    }

    /// Whether the flash was erasing at the last step.
    pub(crate) fn is_at_work(&self) -> bool {
        self.at_work
    }

    /// Does one step; returns whether the area is erased. Sectors that read as erased are not skipped, because an erase
    /// that was cut can look like that.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        self.at_work = flash.is_busy().map_err(|_| Refusal::NotCleared)?;
        if self.at_work {
            return Ok(false);
        }
        let Some((size, others)) = self.sectors.split_first() else { return self.prove(flash) };
        flash.start_erase(self.next).map_err(|_| Refusal::NotCleared)?;
        (self.sectors, self.next, self.at_work) = (others, self.next.saturating_add(*size), true);
        Ok(false)
    }

    fn prove<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        for _ in 0..PIECES {
            if !all_are(read_piece(flash, &mut self.rest, &mut [0; CHUNK])?, 0xFF) {
                return Err(Refusal::NotCleared);
            }
        }
        Ok(self.rest.is_empty())
    }
}
