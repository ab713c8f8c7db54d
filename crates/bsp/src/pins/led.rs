//! The status LED and the indicators.

use stm32f4xx_hal::pac::RCC;

use crate::boards::BOARD;
use crate::pins::gpio::output_of;

/// The pin of the LED.
pub(crate) type Pin = output_of!(BOARD.led);

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

/// The indicators RUN and ERROR of CiA 303-3.
pub struct Indicators(Run, Error);

type Run = output_of!(BOARD.indicators[0]);
type Error = output_of!(BOARD.indicators[1]);

impl Indicators {
    /// The indicators, both off.
    pub(crate) fn new(rcc: &RCC) -> Indicators {
        Indicators(Run::new(rcc), Error::new(rcc))
    }

    /// Switches the indicators.
    pub fn set(&mut self, [run, error]: [bool; 2]) {
        self.0.set(run);
        self.1.set(error);
    }
}
