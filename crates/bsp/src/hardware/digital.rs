//! Digital inputs and outputs: two buttons and two lamps.

use stm32f4xx_hal::gpio::{Input, Output, PC0, PC1, PC10, PC13};

use crate::debounce::Debounce;

/// Two buttons to ground.
pub struct Buttons {
    pins: (PC13<Input>, PC10<Input>),
    debounced: [Debounce; 2],
}

impl Buttons {
    /// The buttons. PC13 is the blue button of the NUCLEO, which has its own pull-up resistor.
    pub(crate) fn new(first: PC13, second: PC10) -> Buttons {
        let pins = (first.into_floating_input(), second.into_pull_up_input());
        Buttons { pins, debounced: [Debounce::new(); 2] }
    }

    /// Which buttons are pressed. To be called once a millisecond, because contacts bounce.
    pub fn sample(&mut self) -> [bool; 2] {
        let [first, second] = &mut self.debounced;
        [first.sample(self.pins.0.is_low()), second.sample(self.pins.1.is_low())]
    }
}

/// Two lamps or their drivers: a high level is on.
pub struct Lamps {
    pins: (PC0<Output>, PC1<Output>),
}

impl Lamps {
    /// The lamps, both off.
    pub(crate) fn new(first: PC0, second: PC1) -> Lamps {
        Lamps { pins: (first.into_push_pull_output(), second.into_push_pull_output()) }
    }

    /// Switches the lamps.
    pub fn set(&mut self, [first, second]: [bool; 2]) {
        self.pins.0.set_state(first.into());
        self.pins.1.set_state(second.into());
    }
}
