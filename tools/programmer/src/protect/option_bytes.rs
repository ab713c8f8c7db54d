//! The option bytes in the layout of FLASH_OPTCR (RM0390, 3.8.6; RM0090, 3.9.7).

use std::fmt;

/// The bits OPTLOCK and OPTSTRT, which are commands and not options.
const COMMANDS: u32 = 0b11;
/// The field RDP.
const READ_OUT: u32 = 0xFF << 8;
const LEVEL_0: u32 = 0xAA << 8;
/// Level 1 is any value except the values of the other two levels.
const LEVEL_1: u32 = 0x55 << 8;
const LEVEL_2: u32 = 0xCC << 8;
/// The nWRP bits of sectors 0 and 1. A sector is protected while its bit is 0.
const BOOTLOADER: u32 = 0b11 << 16;
/// BOR_LEV. All bits set: the brown-out reset is off. None set: level 3, below 2.7 V.
const BROWN_OUT: u32 = 0b11 << 2;
/// SPRMOD, which changes the meaning of the sector bits.
const PROPRIETARY: u32 = 1 << 31;

/// The option bytes of a chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OptionBytes(u32);

/// How much of the flash a debugger, or a program that was not started from flash, can read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadOut {
    /// Level 0: the whole flash.
    Open,
    /// Level 1: nothing. The return to level 0 erases the flash.
    Protected,
    /// Level 2: no debugger can connect, and the option bytes cannot be changed any more.
    Final,
}

impl OptionBytes {
    /// The option bytes of a new STM32F446.
    pub const FACTORY: OptionBytes = OptionBytes(0x0FFF_AAEC);

    /// The option bytes in a value of FLASH_OPTCR.
    #[must_use]
    pub fn from_register(value: u32) -> OptionBytes {
        OptionBytes(value & !COMMANDS)
    }

    /// The value of FLASH_OPTCR, without a command.
    #[must_use]
    pub fn register(self) -> u32 {
        self.0
    }

    /// Whether both sectors of the bootloader are write protected.
    #[must_use]
    pub fn keeps_bootloader(self) -> bool {
        self.0 & BOOTLOADER == 0 && !self.is_proprietary()
    }

    /// Whether the chip is held in reset below 2.7 V (BOR level 3). At 144 MHz with 4 wait states, and for programming
    /// words, the flash needs this voltage (RM0390, tables 5 and 7).
    #[must_use]
    pub fn guards_supply(self) -> bool {
        self.0 & BROWN_OUT == 0
    }

    /// The same option bytes with the brown-out reset at level 3 or off.
    #[must_use]
    pub fn with_brown_out(self, guards: bool) -> OptionBytes {
        self.with_brown_out_level(if guards { 3 } else { 0 })
    }

    /// The same option bytes with the brown-out reset at a level from 0, off, to 3, below 2.7 V.
    #[must_use]
    pub fn with_brown_out_level(self, level: u8) -> OptionBytes {
        let bits = u32::from(level & 0b11) << BROWN_OUT.trailing_zeros();
        OptionBytes((self.0 | BROWN_OUT) & !bits)
    }

    /// The level of the read-out protection.
    #[must_use]
    pub fn read_out(self) -> ReadOut {
        match self.0 & READ_OUT {
            LEVEL_0 => ReadOut::Open,
            LEVEL_2 => ReadOut::Final,
            _ => ReadOut::Protected,
        }
    }

    /// Whether sectors are protected by PCROP, which this project does not support.
    #[must_use]
    pub fn is_proprietary(self) -> bool {
        self.0 & PROPRIETARY != 0
    }

    /// The same option bytes with or without write protection of the bootloader.
    #[must_use]
    pub fn with_bootloader(self, kept: bool) -> OptionBytes {
        OptionBytes(if kept { self.0 & !BOOTLOADER } else { self.0 | BOOTLOADER })
    }

    /// The same option bytes with read-out protection at level 1 or level 0. Level 2 is not offered.
    #[must_use]
    pub fn with_read_out(self, protected: bool) -> OptionBytes {
        let level = if protected { LEVEL_1 } else { LEVEL_0 };
        OptionBytes(self.0 & !READ_OUT | level)
    }

    /// Whether the change to the other option bytes makes the chip erase its whole flash.
    #[must_use]
    pub fn is_erased_by(self, others: OptionBytes) -> bool {
        self.read_out() == ReadOut::Protected && others.read_out() == ReadOut::Open
    }
}

impl fmt::Display for OptionBytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bootloader = if self.keeps_bootloader() { "write protected" } else { "not protected" };
        let read_out = match self.read_out() {
            ReadOut::Open => "open (level 0)",
            ReadOut::Protected => "protected (level 1)",
            ReadOut::Final => "protected for ever (level 2)",
        };
        let brown_out = match self.0 & BROWN_OUT {
            0 => "below 2.7 V (level 3)",
            BROWN_OUT => "off",
            _ => "below level 3",
        };
        write!(
            f,
            "{:08X}h: bootloader {bootloader}, read-out {read_out}, brown-out reset {brown_out}",
            self.0
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_requested_bits_change_and_can_be_restored() {
        let new = OptionBytes::FACTORY;
        assert_eq!((new.keeps_bootloader(), new.read_out()), (false, ReadOut::Open));
        let kept = new.with_bootloader(true);
        assert_eq!((kept.register(), kept.keeps_bootloader()), (0x0FFC_AAEC, true));
        let closed = kept.with_read_out(true);
        assert_eq!((closed.register(), closed.read_out()), (0x0FFC_55EC, ReadOut::Protected));
        assert_eq!(closed.with_read_out(false).with_bootloader(false), new);
        let guarded = new.with_brown_out(true);
        assert_eq!((guarded.register(), guarded.guards_supply()), (0x0FFF_AAE0, true));
        assert_eq!((guarded.with_brown_out(false), new.guards_supply()), (new, false));
        assert!(closed.is_erased_by(kept) && !kept.is_erased_by(closed) && !closed.is_erased_by(closed));
    }

    #[test]
    fn every_value_of_the_level_but_two_protects() {
        for level in 0..=0xFF {
            let bytes = OptionBytes::from_register(0x0FFF_00EF | level << 8);
            assert_eq!(bytes.register() & COMMANDS, 0);
            let expected = match level {
                0xAA => ReadOut::Open,
                0xCC => ReadOut::Final,
                _ => ReadOut::Protected,
            };
            assert_eq!(bytes.read_out(), expected, "{level:02X}h");
            assert_ne!(bytes.with_read_out(true).read_out(), ReadOut::Final);
        }
    }
}
