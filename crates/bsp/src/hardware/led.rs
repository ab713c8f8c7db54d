//! The status LED.

use stm32f4xx_hal::pac::RCC;

use super::gpio::Output;
use crate::boards::BOARD;

/// The LED.
pub struct Led(Output);

impl Led {
    pub(crate) fn new(rcc: &RCC) -> Led {
        Led(Output::new(BOARD.led, rcc))
    }

    /// Switches the LED.
    pub fn set(&mut self, on: bool) {
        self.0.set(on);
    }
}
