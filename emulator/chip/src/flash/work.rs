//! Erase operations, and the end of any operation.

use std::collections::VecDeque;
use std::ops::Range;

use canbus::Time;

use super::{CR_EOPIE, CR_MER, CR_SER, Flash, Refused, SR_EOP, Work, timing, torn};
use crate::peripherals::Effect;
use crate::register::{bit, field, flag};

impl Flash {
    /// Starts the erase that SER or MER selects; with both bits set nothing is erased (RM0390 section 3.5.3).
    pub(super) fn erase(&mut self, now: Time, effects: &mut VecDeque<Effect>) -> Result<(), Refused> {
        let psize = field(self.cr, 8, 2);
        let (chosen, time): (Vec<usize>, Time) = match (bit(self.cr, CR_SER), bit(self.cr, CR_MER)) {
            (true, false) => {
                let sector = field(self.cr, 3, 4) as usize;
                let size = self.variant.sectors().nth(sector).ok_or(Refused::Sequence)?;
                (vec![sector], timing::sector_erase(size, psize))
            }
            (false, true) => (
                (0..self.variant.sectors().count()).collect(),
                timing::mass_erase(self.variant.flash_size(), psize),
            ),
            _ => return Ok(()),
        };
        if chosen.iter().any(|&sector| self.is_protected(sector)) {
            return Err(Refused::WriteProtected);
        }
        self.begin(chosen, time, now, effects);
        Ok(())
    }

    /// Erases the whole array, including protected sectors.
    pub(super) fn erase_all(&mut self, now: Time, effects: &mut VecDeque<Effect>) {
        let time = timing::mass_erase(self.variant.flash_size(), field(self.cr, 8, 2));
        self.begin((0..self.variant.sectors().count()).collect(), time, now, effects);
    }

    fn begin(&mut self, chosen: Vec<usize>, time: Time, now: Time, effects: &mut VecDeque<Effect>) {
        let cut = self.count(chosen.len() as u64);
        let sectors = chosen.into_iter().filter_map(|sector| self.variant.sector(sector)).collect();
        let start = self.free(now);
        self.busy_until = start + if cut { Time(time.0 / 2) } else { time };
        self.work = Some(Work::Erase { sectors, cut });
        effects.push_back(Effect::StallFlash(self.busy_until));
    }

    /// Counts operations; `true` when the power is cut in one of them.
    pub(super) fn count(&mut self, operations: u64) -> bool {
        self.operations += operations;
        self.cut_at.take_if(|at| *at <= self.operations).is_some()
    }

    /// The earliest start of an operation that is requested now.
    pub(super) fn free(&self, now: Time) -> Time {
        now.max(self.busy_until)
    }

    /// Ends the operation under way if its end has been reached.
    pub(crate) fn advance(&mut self, now: Time, effects: &mut VecDeque<Effect>) {
        if now >= self.busy_until {
            self.end_work(effects);
        }
    }

    pub(super) fn end_work(&mut self, effects: &mut VecDeque<Effect>) {
        match self.work.take() {
            None => return,
            Some(Work::Programmed) => {}
            Some(Work::Erase { sectors, cut: true }) => {
                self.tear(&sectors, effects);
                effects.push_back(Effect::PowerCut);
                return;
            }
            Some(Work::Erase { sectors, cut: false }) => {
                effects.extend(sectors.into_iter().map(|range| Effect::Fill { range, byte: 0xFF }));
            }
        }
        // EOP is set only while its interrupt is enabled (RM0390 section 3.8.5).
        self.sr |= flag(bit(self.cr, CR_EOPIE), SR_EOP);
    }

    /// A cut in the erase of several sectors: the first half is erased, the next sector is torn and the rest is
    /// unchanged.
    pub(super) fn tear(&self, sectors: &[Range<u32>], effects: &mut VecDeque<Effect>) {
        let (whole, rest) = sectors.split_at(sectors.len() / 2);
        effects.extend(whole.iter().map(|range| Effect::Fill { range: range.clone(), byte: 0xFF }));
        if let Some(sector) = rest.first() {
            effects.extend(torn::erased(sector.clone(), self.operations ^ u64::from(sector.start)));
        }
    }

    pub(super) fn erases(&self) -> bool {
        matches!(self.work, Some(Work::Erase { .. }))
    }

    pub(super) fn erases_at(&self, address: u32) -> bool {
        matches!(&self.work, Some(Work::Erase { sectors, .. }) if sectors.iter().any(|range| range.contains(&address)))
    }

    pub(super) fn sector_at(&self, address: u32) -> Option<usize> {
        (0..self.variant.sectors().count())
            .find(|&sector| self.variant.sector(sector).is_some_and(|range| range.contains(&address)))
    }

    pub(super) fn is_protected(&self, sector: usize) -> bool {
        bit(self.write_protected(), sector as u32)
    }
}
