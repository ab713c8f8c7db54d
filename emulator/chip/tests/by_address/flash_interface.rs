//! The registers of the flash (RM0390, 3.8) and their use by a driver.

use canbus::Time;

use crate::support::Rig;

pub(crate) const FLASH: u32 = 0x4002_3C00;
pub(crate) const KEYR: u32 = FLASH + 0x04;
pub(crate) const SR: u32 = FLASH + 0x0C;
pub(crate) const CR: u32 = FLASH + 0x10;

/// Flags of SR.
pub(crate) const EOP: u32 = 1;
pub(crate) const WRPERR: u32 = 1 << 4;
pub(crate) const PGAERR: u32 = 1 << 5;
pub(crate) const PGPERR: u32 = 1 << 6;
pub(crate) const PGSERR: u32 = 1 << 7;
pub(crate) const BSY: u32 = 1 << 16;

/// Bits of CR: programming, sector erase, mass erase, the start, and the interrupts.
pub(crate) const PG: u32 = 1;
pub(crate) const SER: u32 = 1 << 1;
pub(crate) const MER: u32 = 1 << 2;
pub(crate) const STRT: u32 = 1 << 16;
pub(crate) const EOPIE: u32 = 1 << 24;
pub(crate) const ERRIE: u32 = 1 << 25;
pub(crate) const LOCK: u32 = 1 << 31;
/// PSIZE: words.
pub(crate) const X32: u32 = 2 << 8;

/// The keys for KEYR, in order.
pub(crate) const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// The value of CR that selects a sector for an erase.
pub(crate) const fn erasure(sector: u32) -> u32 {
    SER | sector << 3 | X32
}

impl Rig {
    /// Writes both keys.
    pub(crate) fn unlock_flash(&mut self) {
        KEYS.into_iter().for_each(|key| self.write(KEYR, key));
    }

    /// Starts to erase a sector.
    pub(crate) fn erase(&mut self, sector: u32) {
        self.write(CR, erasure(sector));
        self.write(CR, erasure(sector) | STRT);
    }

    /// Waits for the end of the operation and returns the duration, to 16 us.
    pub(crate) fn wait_for_flash(&mut self) -> Time {
        let start = self.now;
        while self.read(SR) & BSY != 0 {
            self.wait(Time::from_micros(16));
        }
        self.now - start
    }
}
