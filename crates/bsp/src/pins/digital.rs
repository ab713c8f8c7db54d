//! Digital inputs and outputs: two buttons and two lamps.

use stm32f4xx_hal::pac::RCC;

use crate::boards::BOARD;
use crate::pins::debounce::Debounce;
use crate::pins::gpio::{input_of, output_of};

type First = input_of!(BOARD.buttons[0]);
type Second = input_of!(BOARD.buttons[1]);
type Left = output_of!(BOARD.lamps[0]);
type Right = output_of!(BOARD.lamps[1]);

/// Two buttons.
pub struct Buttons {
    pins: (First, Second),
    debounced: [Debounce; 2],
}

impl Buttons {
    pub(crate) fn new(rcc: &RCC) -> Buttons {
        let [first, second] = BOARD.buttons;
        let pins = (First::new(first.pull, rcc), Second::new(second.pull, rcc));
        Buttons { pins, debounced: [Debounce::new(); 2] }
    }

    /// Which buttons are pressed. To be called once a millisecond, because contacts bounce.
    pub fn sample(&mut self) -> [bool; 2] {
        let [first, second] = &mut self.debounced;
        [first.sample(self.pins.0.is_pressed()), second.sample(self.pins.1.is_pressed())]
    }
}

/// Two lamps or their drivers.
pub struct Lamps(Left, Right);

impl Lamps {
    /// The lamps, both off.
    pub(crate) fn new(rcc: &RCC) -> Lamps {
        Lamps(Left::new(rcc), Right::new(rcc))
    }

    /// Switches the lamps.
    pub fn set(&mut self, [first, second]: [bool; 2]) {
        self.0.set(first);
        self.1.set(second);
    }
}
