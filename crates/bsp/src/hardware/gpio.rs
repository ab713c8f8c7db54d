//! Pins that the board file names: inputs and outputs by port and number.

use stm32f4xx_hal::pac::{GPIOA, RCC, gpioa};

use crate::boards::{Button, Light, Pin, Pull};

/// Distance of two ports in bytes (RM0390, table 1).
const STEP: usize = 0x400;

/// The registers of a port.
pub(super) fn port(letter: char) -> &'static gpioa::RegisterBlock {
    let first: *const gpioa::RegisterBlock = GPIOA::ptr();
    // SAFETY: all ports have the same registers, STEP bytes apart, and the boards have the ports A to H. Each pin is
    // changed by its owner only.
    unsafe { &*first.byte_add(number(letter) * STEP) }
}

fn number(letter: char) -> usize {
    (letter as usize).saturating_sub('A' as usize) & 0x7
}

/// Switches the clock of the port on, and sets the mode of the pin: 0 input, 1 output.
fn set_mode(pin: Pin, mode: u32, rcc: &RCC) {
    // SAFETY: a bit for each port, in the order of the ports.
    rcc.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << number(pin.port)) });
    let _ = rcc.ahb1enr().read();
    let place = 2 * u32::from(pin.number);
    // SAFETY: MODER takes any value.
    port(pin.port).moder().modify(|r, w| unsafe { w.bits(r.bits() & !(0b11 << place) | mode << place) });
}

/// An output.
pub(super) struct Output {
    port: &'static gpioa::RegisterBlock,
    light: Light,
}

impl Output {
    /// The output, off.
    pub(super) fn new(light: Light, rcc: &RCC) -> Output {
        let output = Output { port: port(light.pin.port), light };
        // SAFETY: the clock of the port, so that the level is set before the pin is an output.
        rcc.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << number(light.pin.port)) });
        output.set(false);
        set_mode(light.pin, 1, rcc);
        output
    }

    /// Switches it. One store, at any priority.
    pub(super) fn set(&self, on: bool) {
        let high = on == self.light.on;
        let place = self.light.pin.number + if high { 0 } else { 16 };
        // SAFETY: BSRR takes any value, and changes the pins with a bit only.
        self.port.bsrr().write(|w| unsafe { w.bits(1 << place) });
    }

    /// Switches it to the other state.
    pub(super) fn toggle(&self) {
        let is_high = self.port.odr().read().bits() >> self.light.pin.number & 1 != 0;
        self.set(is_high != self.light.on);
    }
}

/// An input with a button.
pub(super) struct Input(Button);

impl Input {
    pub(super) fn new(button: Button, rcc: &RCC) -> Input {
        set_mode(button.pin, 0, rcc);
        let place = 2 * u32::from(button.pin.number);
        let pull = match button.pull {
            Pull::None => 0,
            Pull::Up => 1,
            Pull::Down => 2,
        };
        // SAFETY: the values are those of PUPDR.
        port(button.pin.port)
            .pupdr()
            .modify(|r, w| unsafe { w.bits(r.bits() & !(0b11 << place) | pull << place) });
        Input(button)
    }

    /// Whether the button is pressed.
    pub(super) fn is_pressed(&self) -> bool {
        let Button { pin, pressed, .. } = self.0;
        (port(pin.port).idr().read().bits() >> pin.number & 1 != 0) == pressed
    }
}
