//! The option bytes as FLASH_OPTCR has them (RM0390, 3.8.6; RM0090, 3.9.7).

use std::fmt;

/// OPTLOCK and OPTSTRT, which are commands and no options.
const COMMANDS: u32 = 0b11;
/// RDP.
const READ_OUT: u32 = 0xFF << 8;
const LEVEL_0: u32 = 0xAA << 8;
/// Any value but those of the other two levels.
const LEVEL_1: u32 = 0x55 << 8;
const LEVEL_2: u32 = 0xCC << 8;
/// nWRP of sectors 0 and 1: a sector is protected while its bit is 0.
const BOOTLOADER: u32 = 0b11 << 16;
/// SPRMOD: with it the bits of the sectors mean something else.
const PROPRIETARY: u32 = 1 << 31;

/// What they say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OptionBytes(u32);

/// How far a debugger, or a program that was not started from flash, can read the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadOut {
    /// Level 0: all of it.
    Open,
    /// Level 1: nothing. The way back erases everything.
    Protected,
    /// Level 2: no debugger connects, and nothing changes the option bytes any more.
    Final,
}

impl OptionBytes {
    /// As a new STM32F446 has them.
    pub const FACTORY: OptionBytes = OptionBytes(0x0FFF_AAEC);

    /// Those in a value of FLASH_OPTCR.
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

    /// The level of the read-out protection.
    #[must_use]
    pub fn read_out(self) -> ReadOut {
        match self.0 & READ_OUT {
            LEVEL_0 => ReadOut::Open,
            LEVEL_2 => ReadOut::Final,
            _ => ReadOut::Protected,
        }
    }

    /// Whether sectors are protected against reading by their owner (PCROP), which this project knows nothing of.
    #[must_use]
    pub fn is_proprietary(self) -> bool {
        self.0 & PROPRIETARY != 0
    }

    /// The same with the bootloader write protected, or not.
    #[must_use]
    pub fn with_bootloader(self, kept: bool) -> OptionBytes {
        OptionBytes(if kept { self.0 & !BOOTLOADER } else { self.0 | BOOTLOADER })
    }

    /// The same at level 1, or at level 0. There is no way to level 2 here.
    #[must_use]
    pub fn with_read_out(self, protected: bool) -> OptionBytes {
        let level = if protected { LEVEL_1 } else { LEVEL_0 };
        OptionBytes(self.0 & !READ_OUT | level)
    }

    /// Whether a chip that has these and gets the others erases all of its flash.
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
        write!(f, "{:08X}h: bootloader {bootloader}, read-out {read_out}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_asked_for_changes_and_it_comes_back() {
        let new = OptionBytes::FACTORY;
        assert_eq!((new.keeps_bootloader(), new.read_out()), (false, ReadOut::Open));
        let kept = new.with_bootloader(true);
        assert_eq!((kept.register(), kept.keeps_bootloader()), (0x0FFC_AAEC, true));
        let closed = kept.with_read_out(true);
        assert_eq!((closed.register(), closed.read_out()), (0x0FFC_55EC, ReadOut::Protected));
        assert_eq!(closed.with_read_out(false).with_bootloader(false), new);
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
