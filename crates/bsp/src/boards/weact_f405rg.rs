//! `WeAct` Studio STM32F405 Core Board V1.0, with a crystal of 8 MHz (the device tree of Zephyr, `weact_stm32f405_core`). Its
//! SD slot shares PC10 with button 2: leave it empty.

use super::{Board, Button, Chip, Light, Oscillator, Pin, Pull, front_end};

pub(super) const BOARD: Board = Board {
    name: "WeAct STM32F405RG",
    chip: Chip::F405,
    oscillator: Oscillator { hertz: 8_000_000, is_bypassed: false },
    led: Light { pin: Pin::new('B', 2), on: true },
    indicators: [Light { pin: Pin::new('B', 0), on: true }, Light { pin: Pin::new('B', 1), on: true }],
    buttons: [
        // KEY, to the supply.
        Button { pin: Pin::new('C', 13), pull: Pull::Down, pressed: true },
        Button { pin: Pin::new('C', 10), pull: Pull::Up, pressed: false },
    ],
    lamps: [Light { pin: Pin::new('C', 0), on: true }, Light { pin: Pin::new('C', 1), on: true }],
    standby: Light { pin: Pin::new('B', 12), on: true },
    front_end: front_end::DEFAULT,
};
