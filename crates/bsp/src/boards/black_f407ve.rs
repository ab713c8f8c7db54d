//! The black board with an `STM32F407VET6`, marked `STM32_F4VE V2.0`, with a crystal of 8 MHz (the device tree of Zephyr,
//! `black_f407ve`). PA0 has the button `WK_UP` to the supply: do not press it. PB5 also goes to the input of a flash chip.

use super::{Board, Button, Chip, Light, Oscillator, Pin, Pull, front_end};

pub(super) const BOARD: Board = Board {
    name: "STM32_F4VE V2.0",
    chip: Chip::F407,
    oscillator: Oscillator { hertz: 8_000_000, is_bypassed: false },
    // D2, between the supply and the pin.
    led: Light { pin: Pin::new('A', 6), on: false },
    // PB0 selects a flash chip on this board.
    indicators: [Light { pin: Pin::new('E', 5), on: true }, Light { pin: Pin::new('E', 6), on: true }],
    buttons: [
        // K0 and K1, to ground.
        Button { pin: Pin::new('E', 4), pull: Pull::Up, pressed: false },
        Button { pin: Pin::new('E', 3), pull: Pull::Up, pressed: false },
    ],
    lamps: [Light { pin: Pin::new('C', 0), on: true }, Light { pin: Pin::new('C', 1), on: true }],
    standby: Light { pin: Pin::new('B', 12), on: true },
    front_end: front_end::DEFAULT,
};
