//! The registers that the steps read (RM0390, RM0090), and what a running node has in them.

use bsp::boards::ALL;

/// CPUID of a Cortex-M4 r0p1 (ARM DDI 0439, 4.1).
pub const CPUID: (u32, u32) = (0xE000_ED00, 0x410F_C241);
/// DBGMCU_IDCODE; its lower 12 bits name the device.
pub const IDCODE: u32 = 0xE004_2000;
/// Size of the flash in KiB, in the upper half of the word.
pub const FLASH_SIZE: u32 = 0x1FFF_7A20;
/// VREFIN_CAL, in the upper half of the word.
pub const REFERENCE_CALIBRATION: u32 = 0x1FFF_7A28;
/// TS_CAL1 in the lower half, TS_CAL2 in the upper one.
pub const TEMPERATURE_CALIBRATION: u32 = 0x1FFF_7A2C;
/// FLASH_ACR and FLASH_OPTCR.
pub const FLASH_ACR: u32 = 0x4002_3C00;
/// The option bytes.
pub const FLASH_OPTCR: u32 = 0x4002_3C14;
/// RCC_CR, RCC_PLLCFGR, RCC_CFGR in a row.
pub const RCC: u32 = 0x4002_3800;
/// CAN_MCR, CAN_MSR, CAN_TSR.
pub const CAN_MCR: u32 = 0x4000_6400;
/// CAN_MSR.
pub const CAN_MSR: u32 = 0x4000_6404;
/// CAN_TSR.
pub const CAN_TSR: u32 = 0x4000_6408;
/// CAN_ESR.
pub const CAN_ESR: u32 = 0x4000_6418;
/// CAN_BTR.
pub const CAN_BTR: u32 = 0x4000_641C;
/// GPIOB_IDR.
pub const PORT_B: u32 = 0x4002_0410;
/// DMA2_S0M0AR: the address of the buffer with the conversions.
pub const CONVERSIONS: u32 = 0x4002_641C;
/// NVIC_ICER0: the first of three words that switch interrupts off.
pub const INTERRUPTS_OFF: u32 = 0xE000_E180;

/// A chip that the images exist for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// The device in DBGMCU_IDCODE.
    pub device: u32,
    /// The size of the flash in KiB.
    pub flash: u32,
    /// Whether the board feeds a clock into OSC_IN, and has no crystal.
    pub bypass: bool,
}

impl Chip {
    /// The chip that probe-rs calls so.
    #[must_use]
    pub fn named(name: &str) -> Option<Chip> {
        let name = name.to_ascii_lowercase();
        let (_, board) = ALL.into_iter().find(|(_, board)| name.starts_with(board.chip.name))?;
        // The letter of the flash size: E 512 KiB, G 1 MiB.
        let flash = if name.chars().nth(10) == Some('e') { 512 } else { 1024 };
        Some(Chip { device: board.chip.device, flash, bypass: board.oscillator.is_bypassed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chip_has_the_clock_source_of_its_board_and_the_flash_of_its_name() {
        let chip = |device, flash, bypass| Some(Chip { device, flash, bypass });
        assert_eq!(Chip::named("STM32F446RETx"), chip(0x421, 512, true));
        assert_eq!(Chip::named("stm32f405RGTx"), chip(0x413, 1024, false));
        assert_eq!(Chip::named("STM32F407VETx"), chip(0x413, 512, false));
        assert_eq!(Chip::named("STM32F103C8"), None);
    }
}
