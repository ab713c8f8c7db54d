//! The status LED.

use stm32f4xx_hal::pac::RCC;

use super::gpio::output_of;
use crate::boards::BOARD;

/// The pin of the LED.
pub(super) type Pin = output_of!(BOARD.led);

/// The LED.
pub struct Led(Pin);

impl Led {
    pub(crate) fn new(rcc: &RCC) -> Led {
        Led(Pin::new(rcc))
    }

    /// Switches the LED.
    pub fn set(&mut self, on: bool) {
        self.0.set(on);
    }
}
