//! The backup SRAM, which keeps its content while the main supply is off, as long as there is a battery at VBAT.
#![expect(unsafe_code, reason = "registers, and the backup SRAM by its address")]

use stm32f4xx_hal::pac::{CRC, PWR};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::losses::{Event, Losses};
use crate::power::backup_copies::{BackupCopies, BackupState, Checksum, Content, Slots};

/// Start of the 4 KiB (RM0390, table 1; RM0090, table 1).
const BASE: *const Slots = 0x4002_4000 as *const Slots;

const _: () = assert!(size_of::<Slots>() <= 4096);

/// The highest level of the voltage detector, 2.9 V.
const PLS_2_9_V: u8 = 7;

/// The memory with two copies of its content: see [`BackupCopies`].
pub struct BackupMemory {
    power: PWR,
    copies: BackupCopies<'static, CrcUnit>,
    losses: &'static Losses,
}

/// CRC-32/MPEG-2 by the CRC unit of the chip (RM0390, 4).
struct CrcUnit(CRC);

impl CrcUnit {
    fn new(crc: CRC, rcc: &mut Rcc) -> CrcUnit {
        CRC::enable(rcc);
        CRC::reset(rcc);
        CrcUnit(crc)
    }
}

impl Checksum for CrcUnit {
    fn start(&mut self, word: u32) {
        self.0.cr().write(|w| w.reset().set_bit());
        self.add(word);
    }

    fn add(&mut self, word: u32) {
        self.0.dr().write(|w| w.dr().set(word));
    }

    fn value(&self) -> u32 {
        self.0.dr().read().bits()
    }
}

impl BackupMemory {
    /// Switches the memory on and finds the newer copy. The backup regulator need not be ready yet, because the memory
    /// runs from the main supply until that fails (RM0390, 5.1.2).
    pub(crate) fn open(
        power: PWR,
        crc: CRC,
        losses: &'static Losses,
        rcc: &mut Rcc,
    ) -> (BackupMemory, BackupState) {
        PWR::enable(rcc);
        rcc.ahb1enr().modify(|_, w| w.bkpsramen().set_bit());
        protect(&power, false);
        power.csr().modify(|_, w| w.bre().set_bit());
        // SAFETY: PLS takes any level; this one is 2.9 V (RM0390, 5.4.1).
        power.cr().modify(|_, w| unsafe { w.pls().bits(PLS_2_9_V).pvde().set_bit() });
        protect(&power, true);
        // SAFETY: the memory exists, is on and aligned, and any bits in it are valid numbers. `power` is given to this
        // function only, and once, so nothing else refers to the memory.
        let slots = unsafe { &*BASE };
        let (copies, found) = BackupCopies::open(slots, CrcUnit::new(crc, rcc));
        (BackupMemory { power, copies, losses }, found)
    }

    /// Writes the older copy. The memory is write protected except during this call. A write that fails is counted
    /// ([`Event::BackupWrite`]); the newer copy stays valid, and the next write goes to the same place.
    pub fn write(&mut self, content: &Content) {
        protect(&self.power, false);
        let is_kept = self.copies.write(content);
        protect(&self.power, true);
        if !is_kept {
            self.losses.count(Event::BackupWrite);
        }
    }
}

/// Whether the supply is above the level of the voltage detector, which [`BackupMemory::open`] sets: the flash is changed
/// by words, which need 2.7 V (RM0390, table 7).
pub(crate) fn is_supplied() -> bool {
    // SAFETY: a read of a flag.
    unsafe { (*PWR::ptr()).csr().read().pvdo().bit_is_clear() }
}

/// Sets DBP. The bus of PWR is slower than the bus of the memory, so the register is read back to wait until the write
/// has arrived.
fn protect(power: &PWR, on: bool) {
    power.cr().modify(|_, w| w.dbp().bit(!on));
    let _ = power.cr().read();
}
