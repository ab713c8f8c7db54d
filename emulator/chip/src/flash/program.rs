//! Programming: the effect of a store by the core into the array (RM0390 section 3.5.4).

use std::collections::VecDeque;

use canbus::Time;

use super::{CR_PG, Flash, Refused, Work, timing, torn};
use crate::peripherals::{BusFault, Effect};
use crate::register::field;
use crate::variant::FLASH_BASE;

/// A store into the array: the address, the old and the new content.
#[derive(Clone, Debug)]
pub(super) struct Store {
    address: u32,
    old: Vec<u8>,
    new: Vec<u8>,
}

impl Store {
    fn end(&self) -> u32 {
        self.address + self.new.len() as u32
    }

    /// The double word of this store and the one that follows.
    fn join(self, next: Store) -> Store {
        Store { old: [self.old, next.old].concat(), new: [self.new, next.new].concat(), ..self }
    }

    /// The content after programming, which only clears bits.
    fn result(&self) -> Vec<u8> {
        self.old.iter().zip(&self.new).map(|(old, new)| old & new).collect()
    }
}

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
        // The store waits for an erase under way, and then finds the sector erased.
        let erased = self.erases_at(address);
        self.end_work(effects);
        if effects.back() == Some(&Effect::PowerCut) {
            return Ok(());
        }
        let old = if erased { vec![0xFF; new.len()] } else { old.to_vec() };
        let outcome = self.accept(Store { address, old, new: new.to_vec() });
        let outcome =
            outcome.map(|unit| unit.into_iter().for_each(|unit| self.start_program(&unit, now, effects)));
        self.report(outcome);
        Ok(())
    }

    /// The unit to program now; `None` while half of a double word is missing.
    fn accept(&mut self, store: Store) -> Result<Option<Store>, Refused> {
        let modes = field(self.cr, 0, 3);
        if !self.lock.is_open() || modes != 1 << CR_PG {
            return Err(Refused::Sequence);
        }
        let width = 1 << field(self.cr, 8, 2);
        let Some(unit) = self.gather(store, width)? else { return Ok(None) };
        if unit.address % 16 + width > 16 {
            return Err(Refused::Alignment);
        }
        if self.sector_at(unit.address).is_some_and(|sector| self.is_protected(sector)) {
            return Err(Refused::WriteProtected);
        }
        Ok(Some(unit))
    }

    /// Collects a unit of `width` bytes. The core stores a double word as two words: the first word is kept until the
    /// second one comes.
    fn gather(&mut self, store: Store, width: u32) -> Result<Option<Store>, Refused> {
        let kept = self.half.take();
        match (width, store.new.len() as u32, kept) {
            (8, 4, None) if store.address.is_multiple_of(8) => {
                self.half = Some(store);
                Ok(None)
            }
            (8, 4, Some(first)) if first.end() == store.address => Ok(Some(first.join(store))),
            (_, length, None) if length == width => Ok(Some(store)),
            _ => Err(Refused::Parallelism),
        }
    }

    fn start_program(&mut self, unit: &Store, now: Time, effects: &mut VecDeque<Effect>) {
        let address = unit.address;
        if self.count(1) {
            let bytes = torn::programmed(&unit.old, &unit.new, u64::from(address));
            effects.extend([Effect::Store { address, bytes }, Effect::PowerCut]);
            return;
        }
        self.busy_until = self.free(now) + timing::PROGRAM;
        self.work = Some(Work::Programmed);
        effects
            .extend([Effect::Store { address, bytes: unit.result() }, Effect::StallFlash(self.busy_until)]);
    }
}
