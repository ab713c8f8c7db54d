//! Digital inputs and outputs: two buttons and two lamps.

use stm32f4xx_hal::pac::RCC;

use super::gpio::{Input, Output};
use crate::boards::BOARD;
use crate::debounce::Debounce;

/// Two buttons.
pub struct Buttons {
    pins: [Input; 2],
    debounced: [Debounce; 2],
}

impl Buttons {
    pub(crate) fn new(rcc: &RCC) -> Buttons {
        Buttons { pins: BOARD.buttons.map(|button| Input::new(button, rcc)), debounced: [Debounce::new(); 2] }
    }

    /// Which buttons are pressed. To be called once a millisecond, because contacts bounce.
    pub fn sample(&mut self) -> [bool; 2] {
        let [first, second] = &mut self.debounced;
        [first.sample(self.pins[0].is_pressed()), second.sample(self.pins[1].is_pressed())]
    }
}

/// Two lamps or their drivers.
pub struct Lamps([Output; 2]);

impl Lamps {
    /// The lamps, both off.
    pub(crate) fn new(rcc: &RCC) -> Lamps {
        Lamps(BOARD.lamps.map(|lamp| Output::new(lamp, rcc)))
    }

    /// Switches the lamps.
    pub fn set(&mut self, [first, second]: [bool; 2]) {
        self.0[0].set(first);
        self.0[1].set(second);
    }
}
