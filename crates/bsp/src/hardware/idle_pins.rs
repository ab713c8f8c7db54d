//! Pins without a function. A floating input may draw current and pick up noise, so they become analogue, which
//! switches their input stage off (AN4899, unused pins). Pins that the package lacks count as well.

use stm32f4xx_hal::pac::{GPIOA, RCC, gpioa};

/// Pins that stay: those of the board, and those of the debug port, which have pull resistors (RM0390, 7.3.1).
const KEPT: [u16; PORTS] = [
    // PA0, PA1, PA5, PA13 to PA15.
    0b1110_0000_0010_0011,
    // PB3 to PB9, PB13, PB14.
    0b0110_0011_1111_1000,
    // PC0 to PC2, PC10, PC13.
    0b0010_0100_0000_0111,
    0,
    0,
    0,
    0,
    0,
];
/// Ports A to H.
const PORTS: usize = 8;
/// Distance of two ports in bytes (RM0390, table 1).
const STEP: usize = 0x400;
/// AHB1ENR: the clocks of all ports.
const CLOCKS: u32 = (1 << PORTS) - 1;

/// Makes the pins analogue. To be called when the pins of the board have their functions.
pub(super) fn make_analogue(rcc: &RCC) {
    let before = rcc.ahb1enr().read().bits();
    // SAFETY: the bits of the ports, in the order of their addresses.
    rcc.ahb1enr().write(|w| unsafe { w.bits(before | CLOCKS) });
    let _ = rcc.ahb1enr().read();
    for (port, kept) in KEPT.iter().enumerate() {
        let first: *const gpioa::RegisterBlock = GPIOA::ptr();
        // SAFETY: all ports have the same registers, STEP bytes apart. The owners of the pins change theirs only.
        let port = unsafe { &*first.byte_add(port * STEP) };
        // SAFETY: MODER takes any value.
        port.moder().modify(|r, w| unsafe { w.bits(r.bits() | analogue(!kept)) });
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
