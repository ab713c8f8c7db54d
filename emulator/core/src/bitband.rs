//! Bit-band aliases: every bit of the first megabyte of RAM and of the peripherals is also a word of its own
//! (ARMv7-M ARM, B3.1; Cortex-M4 TRM, section 3.7).

use chip::{BusFault, Peripherals};

use crate::system::System;

/// The word and the bit in it that an alias stands for.
fn target(alias: u32) -> (u32, u32) {
    let region = alias & 0xFC00_0000;
    let offset = alias - region - 0x0200_0000;
    (region + (offset >> 5 & !3), offset >> 2 & 31)
}

impl<P: Peripherals> System<P> {
    pub(crate) fn read_bit(&mut self, alias: u32) -> Result<u32, BusFault> {
        let (address, bit) = target(alias);
        self.read_word(address).map(|word| word >> bit & 1)
    }

    /// The bus matrix reads the word, changes the bit and writes it back.
    pub(crate) fn write_bit(&mut self, alias: u32, value: u32) -> Result<(), BusFault> {
        let (address, bit) = target(alias);
        let word = self.read_word(address)?;
        self.write_word(address, word & !(1 << bit) | (value & 1) << bit)
    }

    fn read_word(&mut self, address: u32) -> Result<u32, BusFault> {
        if address < 0x4000_0000 {
            self.memory.word(address)
        } else {
            self.peripherals.read(address, 4, self.clock.now())
        }
    }

    fn write_word(&mut self, address: u32, word: u32) -> Result<(), BusFault> {
        if address < 0x4000_0000 {
            self.memory.store(address, &word.to_le_bytes())
        } else {
            self.peripherals.write(address, 4, word, self.clock.now())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::target;

    #[test]
    fn aliases_of_the_manual() {
        // Cortex-M4 TRM, figure 3-2.
        assert_eq!(target(0x2200_0000), (0x2000_0000, 0));
        assert_eq!(target(0x2200_001C), (0x2000_0000, 7));
        assert_eq!(target(0x23FF_FFFC), (0x200F_FFFC, 31));
        assert_eq!(target(0x4200_0000 + 0x10 * 32 + 4 * 5), (0x4000_0010, 5));
    }
}
