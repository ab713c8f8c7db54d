//! The differences between the supported chips.

use std::ops::Range;
use std::str::FromStr;

/// A chip that images are built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// STM32F446xE: 512 KiB of flash, RM0390.
    F446,
    /// STM32F405xG: 1 MiB of flash, RM0090.
    F405,
    /// STM32F407xG: the F405 with Ethernet and a camera interface.
    F407,
}

impl Variant {
    /// The chips, each at the place of its discriminant.
    pub(crate) const ALL: [Variant; 3] = [Variant::F446, Variant::F405, Variant::F407];

    /// The name of the chip in the features of the images.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Variant::F446 => "stm32f446",
            Variant::F405 => "stm32f405",
            Variant::F407 => "stm32f407",
        }
    }
}

impl FromStr for Variant {
    type Err = String;

    fn from_str(name: &str) -> Result<Variant, String> {
        let found = Variant::ALL.into_iter().find(|chip| chip.name() == name);
        found
            .ok_or_else(|| format!("{name:?} is no chip; {} are", Variant::ALL.map(Variant::name).join(", ")))
    }
}

/// Address of the first byte of flash.
pub const FLASH_BASE: u32 = 0x0800_0000;

const KIB: u32 = 1024;

impl Variant {
    /// Size of the flash in bytes.
    pub const fn flash_size(self) -> u32 {
        match self {
            Variant::F446 => 512 * KIB,
            Variant::F405 | Variant::F407 => 1024 * KIB,
        }
    }

    /// Sizes of the flash sectors in bytes, in order (RM0390 and RM0090 section 3.4, flash module organisation).
    pub fn sectors(self) -> impl Iterator<Item = u32> {
        let size = |index| match index {
            0..=3 => 16 * KIB,
            4 => 64 * KIB,
            _ => 128 * KIB,
        };
        let count = if self == Variant::F446 { 8 } else { 12 };
        (0..count).map(size)
    }

    /// The addresses of a flash sector; `None` when the chip has no such sector.
    pub fn sector(self, index: usize) -> Option<Range<u32>> {
        let start = FLASH_BASE + self.sectors().take(index).sum::<u32>();
        self.sectors().nth(index).map(|size| start..start + size)
    }

    /// DBGMCU_IDCODE: device and revision (RM0390 section 33.6.1, RM0090 section 38.6.1).
    pub(crate) const fn id_code(self) -> u32 {
        match self {
            Variant::F446 => 0x1000_0421,
            Variant::F405 | Variant::F407 => 0x100F_0413,
        }
    }

    /// The ADC1 input of the internal temperature sensor (RM0390 section 13.10, RM0090 section 13.10).
    pub(crate) const fn temperature_channel(self) -> u32 {
        match self {
            Variant::F446 => 18,
            Variant::F405 | Variant::F407 => 16,
        }
    }
}
