//! Programming: what a store by the core into the array does (RM0390 section 3.5.4).

use std::collections::VecDeque;

use canbus::Time;

use super::{CR_PG, Flash, Refused, Work, timing, torn};
use crate::peripherals::{BusFault, Effect};
use crate::register::field;
use crate::variant::FLASH_BASE;

impl Flash {
    /// A store by the core into the array.
    pub(crate) fn program(
        &mut self,
        address: u32,
        old: &[u8],
        new: &[u8],
        now: Time,
        effects: &mut VecDeque<Effect>,
    ) -> Result<(), BusFault> {
        let range = FLASH_BASE..FLASH_BASE + self.variant.flash_size();
        if !range.contains(&address) {
            return Err(BusFault);
        }
        // The store waits for an erase that is under way, and then finds the sector empty.
        let erased = self.erases_at(address);
        self.end_work(effects);
        if effects.back() == Some(&Effect::PowerCut) {
            return Ok(());
        }
        let old = if erased { vec![0xFF; new.len()] } else { old.to_vec() };
        let outcome = self.program_unit(address, &old, new, now, effects);
        self.report(outcome);
        Ok(())
    }

    fn program_unit(
        &mut self,
        address: u32,
        old: &[u8],
        new: &[u8],
        now: Time,
        effects: &mut VecDeque<Effect>,
    ) -> Result<(), Refused> {
        let modes = field(self.cr, 0, 3);
        if !self.lock.is_open() || modes != 1 << CR_PG {
            return Err(Refused::Sequence);
        }
        let width = 1 << field(self.cr, 8, 2);
        if width == 8 && new.len() == 4 {
            return self.program_half(address, old, new, now, effects);
        }
        if new.len() != width {
            return Err(Refused::Parallelism);
        }
        if address % 16 + width as u32 > 16 {
            return Err(Refused::Alignment);
        }
        if self.sector_at(address).is_some_and(|sector| self.is_protected(sector)) {
            return Err(Refused::WriteProtected);
        }
        self.start_program(address, old, new, now, effects);
        Ok(())
    }

    /// Keeps the first word of a double word until the second comes.
    fn program_half(
        &mut self,
        address: u32,
        old: &[u8],
        new: &[u8],
        now: Time,
        effects: &mut VecDeque<Effect>,
    ) -> Result<(), Refused> {
        let word = |bytes: &[u8]| [0, 1, 2, 3].map(|index| bytes[index]);
        match self.half.take() {
            None if address.is_multiple_of(8) => {
                self.half = Some((address, word(old), word(new)));
                Ok(())
            }
            Some((first, first_old, first_new)) if address == first + 4 => {
                let (old, new) = ([&first_old, old].concat(), [&first_new, new].concat());
                self.program_unit(first, &old, &new, now, effects)
            }
            _ => Err(Refused::Parallelism),
        }
    }

    fn start_program(
        &mut self,
        address: u32,
        old: &[u8],
        new: &[u8],
        now: Time,
        effects: &mut VecDeque<Effect>,
    ) {
        let cut = self.count(1);
        // Programming only clears bits.
        let bytes = if cut {
            torn::programmed(old, new, u64::from(address))
        } else {
            old.iter().zip(new).map(|(old, new)| old & new).collect()
        };
        effects.push_back(Effect::Store { address, bytes });
        if cut {
            effects.push_back(Effect::PowerCut);
            return;
        }
        self.busy_until = self.free(now) + timing::PROGRAM;
        self.work = Some(Work::Programmed);
        effects.push_back(Effect::StallFlash(self.busy_until));
    }
}
