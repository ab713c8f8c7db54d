//! FLASH: the controller of the flash array (RM0390 section 3, RM0090 section 3).
//!
//! Modelled: unlocking, programming in all widths, sector and mass erase, write protection, error flags and busy times.
//! The array itself is kept by the core; effects tell the core how the array changes. A programmed unit changes when
//! the operation starts, an erased sector when the erase ends. A read in between waits for the end of the operation, so
//! the difference cannot be seen.

mod lock;
mod program;
mod timing;
mod torn;
mod work;

use std::collections::VecDeque;
use std::ops::Range;

use canbus::Time;
use lock::{CONTROL_KEYS, Lock, OPTION_KEYS};
use program::Store;

use crate::peripherals::{BusFault, Effect, FlashAccess};
use crate::register::{bit, field, flag};
use crate::variant::Variant;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x04;
const OPTKEYR: u32 = 0x08;
const SR: u32 = 0x0C;
const CR: u32 = 0x10;
const OPTCR: u32 = 0x14;

const SR_EOP: u32 = 0;
const SR_OPERR: u32 = 1;
const SR_BSY: u32 = 16;
/// Flags that are cleared by writing 1.
const SR_CLEARABLE: u32 = 0x1F3;

const CR_PG: u32 = 0;
const CR_SER: u32 = 1;
const CR_MER: u32 = 2;
const CR_STRT: u32 = 16;
const CR_EOPIE: u32 = 24;
const CR_ERRIE: u32 = 25;
const CR_LOCK: u32 = 31;
const CR_WRITABLE: u32 = 0x0300_037F;

const OPTCR_LOCK: u32 = 0;
const OPTCR_BOR: u32 = 2;
const OPTCR_STRT: u32 = 1;
const OPTCR_WRITABLE: u32 = 0x0FFF_FFEC;
/// The first of the nWRP bits: a sector is protected while its bit is 0.
const OPTCR_NWRP: u32 = 16;
const OPTCR_DEFAULT: u32 = 0x0FFF_AAEC;
/// Position of RDP, and the values for levels 0 and 2; any other value means level 1.
const OPTCR_RDP: u32 = 8;
const LEVEL_0: u32 = 0xAA;
const LEVEL_2: u32 = 0xCC;

/// A refused operation, as the number of its flag in FLASH_SR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Refused {
    WriteProtected = 4,
    Alignment = 5,
    Parallelism = 6,
    Sequence = 7,
}

/// The operation under way in the array.
#[derive(Clone, Debug)]
enum Work {
    /// Programming: the array has already changed.
    Programmed,
    /// An erase: the sectors become FFh at the end; with `cut` the power fails before the end.
    Erase { sectors: Vec<Range<u32>>, cut: bool },
}

/// The flash controller.
#[derive(Clone, Debug)]
pub struct Flash {
    variant: Variant,
    acr: u32,
    lock: Lock,
    option_lock: Lock,
    sr: u32,
    cr: u32,
    optcr: u32,
    work: Option<Work>,
    busy_until: Time,
    /// The first half of a double word: the core stores a double word as two words.
    half: Option<Store>,
    operations: u64,
    cut_at: Option<u64>,
    /// BSY stays set until this instant, independent of the array.
    stuck_until: Time,
    /// How often ICRST and DCRST have emptied a cache.
    cache_resets: [u32; 2],
}

impl Flash {
    pub(crate) fn new(variant: Variant, write_protected: u32) -> Self {
        Self {
            variant,
            acr: 0,
            lock: Lock::new(CONTROL_KEYS),
            option_lock: Lock::new(OPTION_KEYS),
            sr: 0,
            cr: 0,
            optcr: OPTCR_DEFAULT & !(write_protected << OPTCR_NWRP),
            work: None,
            busy_until: Time::ZERO,
            half: None,
            operations: 0,
            cut_at: None,
            stuck_until: Time::ZERO,
            cache_resets: [0; 2],
        }
    }

    /// Cuts the power in the `n`th operation from now on (1 is the next one). Each programmed unit and each erased
    /// sector is an operation. The operation leaves a torn unit, and the chip emits `Effect::PowerCut`.
    pub fn cut_power_at_operation(&mut self, n: u64) {
        self.cut_at = Some(self.operations + n);
    }

    /// Keeps BSY set until this instant although the array can be read: the controller hangs.
    pub fn hang(&mut self, until: Time) {
        self.stuck_until = until;
    }

    /// The settings for reads of the array (RM0390, 3.8.1).
    pub(crate) fn access(&self) -> FlashAccess {
        let (caches_code, caches_constants) = (bit(self.acr, 9), bit(self.acr, 10));
        let [code_resets, constant_resets] = self.cache_resets;
        let wait_states = self.wait_states();
        FlashAccess { wait_states, caches_code, caches_constants, code_resets, constant_resets }
    }

    /// FLASH_ACR.LATENCY.
    pub(crate) fn wait_states(&self) -> u32 {
        field(self.acr, 0, 4)
    }

    /// Number of operations so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// Sectors that are write protected, bit 0 for sector 0.
    pub fn write_protected(&self) -> u32 {
        !field(self.optcr, OPTCR_NWRP, 12) & 0xFFF
    }

    /// The supply in volts below which the chip is held in reset: the level of BOR, or that of the power-down reset
    /// (RM0390 section 3.6.1, BOR_LEV; DS10693, embedded reset and power control block characteristics).
    pub(crate) fn reset_level(&self) -> f64 {
        [2.7, 2.4, 2.1, 1.7][field(self.optcr, OPTCR_BOR, 2) as usize]
    }

    /// Whether an operation is under way.
    pub(crate) fn is_busy(&self, now: Time) -> bool {
        now < self.busy_until
    }

    /// Whether an operation is under way with a parallelism of 32 bits or more.
    pub(crate) fn works_by_words(&self, now: Time) -> bool {
        now < self.busy_until && field(self.cr, 8, 2) >= 2
    }

    /// Whether an operation is under way with a parallelism of 64 bits.
    pub(crate) fn works_by_double_words(&self, now: Time) -> bool {
        now < self.busy_until && field(self.cr, 8, 2) == 3
    }

    /// The option bytes at an offset from 1FFF C000h (RM0390 section 3.6.1); what is reserved reads as 1.
    pub(crate) fn option_bytes(&self, offset: u32) -> Option<u32> {
        match offset {
            0x0 => Some(0xFFFF_0000 | self.optcr & 0xFFEC | 0b11),
            0x8 => Some(0xFFFF_F000 | field(self.optcr, OPTCR_NWRP, 12)),
            0x4 | 0xC => Some(u32::MAX),
            _ => None,
        }
    }

    /// A reset. A reset in the middle of an erase leaves the sector torn.
    pub(crate) fn reset(&mut self, effects: &mut VecDeque<Effect>) {
        if let Some(Work::Erase { sectors, .. }) = self.work.take() {
            self.tear(&sectors, effects);
        }
        let fresh = Self::new(self.variant, 0);
        *self = Self { optcr: self.optcr, operations: self.operations, cut_at: self.cut_at, ..fresh };
    }

    pub(crate) fn read(&self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            ACR => Some(self.acr),
            KEYR | OPTKEYR => Some(0),
            SR => Some(self.sr | flag(now < self.busy_until.max(self.stuck_until), SR_BSY)),
            CR => Some(
                self.cr
                    | flag(now < self.busy_until && self.erases(), CR_STRT)
                    | flag(!self.lock.is_open(), CR_LOCK),
            ),
            OPTCR => Some(self.optcr | flag(!self.option_lock.is_open(), OPTCR_LOCK)),
            _ => None,
        }
    }

    /// Writes a register after `advance`; `Ok(None)` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        effects: &mut VecDeque<Effect>,
    ) -> Result<Option<()>, BusFault> {
        match offset {
            ACR => self.write_access(value),
            KEYR => self.lock.take(value)?,
            OPTKEYR => self.option_lock.take(value)?,
            SR => self.sr &= !(value & SR_CLEARABLE),
            CR if self.lock.is_open() => self.write_control(value, now, effects),
            OPTCR if self.option_lock.is_open() => return Ok(self.write_options(value, now, effects)),
            // Locked: a write has no effect.
            CR | OPTCR => {}
            _ => return Ok(None),
        }
        Ok(Some(()))
    }

    /// ICRST and DCRST empty a cache that is off (RM0390 section 3.8.1).
    fn write_access(&mut self, value: u32) {
        for (resets, (enable, reset)) in self.cache_resets.iter_mut().zip([(9, 11), (10, 12)]) {
            *resets += flag(bit(value, reset) && !bit(self.acr | value, enable), 0);
        }
        self.acr = value & 0x1F0F;
    }

    /// A write during an operation waits for its end (RM0390 section 3.8.4).
    fn write_control(&mut self, value: u32, now: Time, effects: &mut VecDeque<Effect>) {
        self.end_work(effects);
        if effects.back() == Some(&Effect::PowerCut) {
            return;
        }
        self.cr = value & CR_WRITABLE;
        self.half = None;
        if bit(value, CR_STRT) {
            let outcome = self.erase(now, effects);
            self.report(outcome);
        }
        if bit(value, CR_LOCK) {
            self.lock.close();
        }
    }

    /// Option bytes are programmed when OPTSTRT is set. `None` for the unmodelled PCROP.
    fn write_options(&mut self, value: u32, now: Time, effects: &mut VecDeque<Effect>) -> Option<()> {
        if bit(value, OPTCR_STRT) && self.read_out_level() != LEVEL_2 {
            self.program_options(value & OPTCR_WRITABLE, now, effects);
        }
        if bit(value, OPTCR_LOCK) {
            self.option_lock.close();
        }
        (!bit(value, 31)).then_some(())
    }

    /// A change from level 1 to level 0 erases the array, including write-protected sectors (RM0390 section 3.6.3).
    fn program_options(&mut self, options: u32, now: Time, effects: &mut VecDeque<Effect>) {
        let before = self.read_out_level();
        self.optcr = options;
        // The reference manual gives no time; the option bytes are erased and programmed like a small sector.
        self.busy_until = self.free(now) + timing::sector_erase(16 * 1024, field(self.cr, 8, 2));
        effects.push_back(Effect::StallFlash(self.busy_until));
        if before != LEVEL_0 && self.read_out_level() == LEVEL_0 {
            self.erase_all(now, effects);
        }
    }

    fn read_out_level(&self) -> u32 {
        field(self.optcr, OPTCR_RDP, 8)
    }

    fn report(&mut self, outcome: Result<(), Refused>) {
        if let Err(refused) = outcome {
            // OPERR is set only while its interrupt is enabled (RM0390 section 3.8.5).
            self.sr |= 1 << refused as u32 | flag(bit(self.cr, CR_ERRIE), SR_OPERR);
        }
    }

    /// The end of the operation under way.
    pub(crate) fn deadline(&self) -> Time {
        let watched = self.erases() || self.work.is_some() && bit(self.cr, CR_EOPIE);
        if watched { self.busy_until } else { Time::NEVER }
    }

    /// The level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        bit(self.sr, SR_EOP) && bit(self.cr, CR_EOPIE) || bit(self.sr, SR_OPERR) && bit(self.cr, CR_ERRIE)
    }
}
