//! Pins without a function. A floating input may draw current and pick up noise, so they become analogue, which
//! switches their input stage off (AN4899, unused pins). Pins that the package lacks count as well.
#![expect(unsafe_code, reason = "registers")]

use stm32f4xx_hal::pac::RCC;

use crate::boards::BOARD;
use crate::pins::gpio::port;

/// Ports A to H.
const PORTS: [char; 8] = ['A', 'B', 'C', 'D', 'E', 'F', 'G', 'H'];
/// Pins that stay: those of the board, and those of the debug port, which have pull resistors (RM0390, 7.3.1).
const KEPT: [u16; PORTS.len()] = {
    let (mut kept, mut at) = ([0; PORTS.len()], 0);
    while at < PORTS.len() {
        kept[at] = BOARD.pins(PORTS[at]);
        at += 1;
    }
    kept
};
/// AHB1ENR: the clocks of all ports.
const CLOCKS: u32 = (1 << PORTS.len()) - 1;

/// Makes the pins analogue. To be called when the pins of the board have their functions.
pub(crate) fn make_analogue(rcc: &RCC) {
    let before = rcc.ahb1enr().read().bits();
    // SAFETY: the bits of the ports, in the order of their addresses.
    rcc.ahb1enr().write(|w| unsafe { w.bits(before | CLOCKS) });
    let _ = rcc.ahb1enr().read();
    for (letter, kept) in PORTS.into_iter().zip(KEPT) {
        // SAFETY: MODER takes any value.
        port(letter).moder().modify(|r, w| unsafe { w.bits(r.bits() | analogue(!kept)) });
    }
    // SAFETY: as above.
    rcc.ahb1enr().write(|w| unsafe { w.bits(before) });
}

/// MODER: 11 for each of these pins.
const fn analogue(pins: u16) -> u32 {
    let [mut bits, mut pin] = [0, 0];
    while pin < 16 {
        bits |= ((pins as u32 >> pin & 1) * 0b11) << (2 * pin);
        pin += 1;
    }
    bits
}
