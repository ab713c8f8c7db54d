//! The status LED of the NUCLEO, LD2.

use stm32f4xx_hal::gpio::{Output, PA5};

/// The LED.
pub struct Led(PA5<Output>);

impl Led {
    pub(crate) fn new(pin: PA5) -> Led {
        Led(pin.into_push_pull_output())
    }

    /// Switches the LED.
    pub fn set(&mut self, on: bool) {
        self.0.set_state(on.into());
    }
}
