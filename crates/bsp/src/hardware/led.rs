//! The status LED of the NUCLEO, LD2.

use stm32f4xx_hal::gpio::{Output, PA5};
use stm32f4xx_hal::pac::{GPIOA, RCC};

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

/// Changes the LED before any pin has an owner, while the node waits for its clock.
pub(super) fn flicker(rcc: &RCC) {
    rcc.ahb1enr().modify(|_, w| w.gpioaen().set_bit());
    // SAFETY: nobody has the pins yet.
    let port = unsafe { &*GPIOA::ptr() };
    port.moder().modify(|_, w| w.moder5().output());
    port.odr().modify(|r, w| w.odr5().bit(r.odr5().bit_is_clear()));
}
