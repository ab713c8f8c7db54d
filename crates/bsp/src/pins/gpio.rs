//! Pins that the board file names: inputs and outputs by port and number, as types, so that an access is a constant.
#![expect(unsafe_code, reason = "registers")]

use stm32f4xx_hal::pac::{GPIOA, RCC, gpioa};

use crate::boards::Pull;

/// Distance of two ports in bytes (RM0390, table 1).
const STEP: usize = 0x400;

/// The registers of a port.
pub(crate) fn port(letter: char) -> &'static gpioa::RegisterBlock {
    let first: *const gpioa::RegisterBlock = GPIOA::ptr();
    // SAFETY: all ports have the same registers, STEP bytes apart, and the boards have the ports A to H. Each pin is
    // changed by its owner only.
    unsafe { &*first.byte_add(place_of(letter) * STEP) }
}

const fn place_of(letter: char) -> usize {
    (letter as usize - 'A' as usize) & 0x7
}

/// Switches the clock of a port on.
pub(crate) fn enable(letter: char, rcc: &RCC) {
    // SAFETY: a bit for each port, in the order of the ports.
    rcc.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << place_of(letter)) });
    let _ = rcc.ahb1enr().read();
}

/// Changes the two bits of a pin in a register.
const fn field(register: u32, pin: u8, value: u32) -> u32 {
    register & !(0b11 << (2 * pin)) | value << (2 * pin)
}

/// An output; `ON` is the level that switches it on.
pub(crate) struct Output<const PORT: char, const PIN: u8, const ON: bool>;

impl<const PORT: char, const PIN: u8, const ON: bool> Output<PORT, PIN, ON> {
    /// The output, off.
    pub(crate) fn new(rcc: &RCC) -> Self {
        enable(PORT, rcc);
        let output: Self = Output;
        output.set(false);
        // SAFETY: MODER takes any value; 1 is an output.
        port(PORT).moder().modify(|r, w| unsafe { w.bits(field(r.bits(), PIN, 1)) });
        output
    }

    /// Switches it. One store, at any priority.
    pub(crate) fn set(&self, on: bool) {
        let place = if on == ON { PIN } else { PIN + 16 };
        // SAFETY: BSRR takes any value, and changes the pins with a bit only.
        port(PORT).bsrr().write(|w| unsafe { w.bits(1 << place) });
    }

    /// Switches it to the other state.
    pub(crate) fn toggle(&self) {
        let is_high = port(PORT).odr().read().bits() >> PIN & 1 != 0;
        self.set(is_high != ON);
    }
}

/// An input with a button; `PRESSED` is the level of a pressed button.
pub(crate) struct Input<const PORT: char, const PIN: u8, const PRESSED: bool>;

impl<const PORT: char, const PIN: u8, const PRESSED: bool> Input<PORT, PIN, PRESSED> {
    pub(crate) fn new(pull: Pull, rcc: &RCC) -> Self {
        enable(PORT, rcc);
        let resistor = match pull {
            Pull::None => 0,
            Pull::Up => 1,
            Pull::Down => 2,
        };
        // SAFETY: the values are those of MODER and PUPDR; 0 is an input.
        unsafe {
            port(PORT).moder().modify(|r, w| w.bits(field(r.bits(), PIN, 0)));
            port(PORT).pupdr().modify(|r, w| w.bits(field(r.bits(), PIN, resistor)));
        }
        Input
    }

    /// Whether the button is pressed.
    pub(crate) fn is_pressed(&self) -> bool {
        (port(PORT).idr().read().bits() >> PIN & 1 != 0) == PRESSED
    }
}

/// The output of a light of the board.
macro_rules! output_of {
    ($light:expr) => {
        $crate::pins::gpio::Output<{ $light.pin.port }, { $light.pin.number }, { $light.on }>
    };
}

/// The input of a button of the board.
macro_rules! input_of {
    ($button:expr) => {
        $crate::pins::gpio::Input<{ $button.pin.port }, { $button.pin.number }, { $button.pressed }>
    };
}

pub(crate) use {input_of, output_of};
