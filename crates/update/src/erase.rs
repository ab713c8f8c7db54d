//! The erase of an area, sector by sector, with a check that the area is erased.

use core::ops::Range;

use crate::area::Area;
use crate::flash::{Flash, all_are, read_step};
use crate::refusal::Refusal;

/// An erase in progress.
#[derive(Clone, Debug)]
pub(crate) struct Erase {
    area: Area,
    /// Number of sectors whose erase was begun.
    begun: usize,
    at_work: bool,
    /// Range that has not been checked yet.
    rest: Range<u32>,
}

impl Erase {
    pub(crate) fn new(area: Area) -> Erase {
        Erase { area, begun: 0, at_work: false, rest: area.start()..area.end() }
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
        match self.area.sectors().nth(self.begun) {
            Some(sector) => self.begin(flash, sector.start),
            None => self.prove(flash),
        }
    }

    fn begin<F: Flash>(&mut self, flash: &mut F, sector: u32) -> Result<bool, Refusal> {
        flash.start_erase(sector).map_err(|_| Refusal::NotCleared)?;
        (self.begun, self.at_work) = (self.begun.saturating_add(1), true);
        Ok(false)
    }

    fn prove<F: Flash>(&mut self, flash: &mut F) -> Result<bool, Refusal> {
        let mut erased = true;
        self.rest.start = read_step(flash, self.rest.clone(), &mut |bytes| {
            erased &= all_are(bytes, 0xFF);
        })?;
        if erased { Ok(self.rest.is_empty()) } else { Err(Refusal::NotCleared) }
    }
}
