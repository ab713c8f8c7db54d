//! Values that the chip's manufacturer has programmed into the system memory: unique ID, sizes, calibration.
#![expect(unsafe_code, reason = "memory by its address")]

use stm32f4xx_hal::signature::{VrefCal, VtempCal30, VtempCal110};

use crate::analog::chip_thermometer::Calibration;
use crate::chip::serial_number::serial_number as from_unique_id;

/// The unique identifier, 96 bits (RM0390, 34.1).
const UNIQUE_ID: *const [u8; 12] = 0x1FFF_7A10 as *const _;

/// Serial number of the board, from the unique identifier.
#[inline(never)]
pub fn serial_number() -> u32 {
    // SAFETY: system memory, readable and constant on every STM32F4.
    from_unique_id(&unsafe { UNIQUE_ID.read() })
}

/// The calibration of this chip.
pub fn calibration() -> Calibration {
    Calibration {
        temperature_30: VtempCal30::get().read(),
        temperature_110: VtempCal110::get().read(),
        reference: VrefCal::get().read(),
    }
}
