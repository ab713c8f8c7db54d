//! NUCLEO-F446RE (UM1724): the default. The ST-LINK feeds its clock into `OSC_IN`.

use super::{Board, Button, Chip, Light, Oscillator, Pin, Pull, front_end};

pub(super) const BOARD: Board = Board {
    name: "NUCLEO-F446RE",
    chip: Chip::F446,
    oscillator: Oscillator { hertz: 8_000_000, is_bypassed: true },
    // LD2.
    led: Light { pin: Pin::new('A', 5), on: true },
    indicators: [Light { pin: Pin::new('B', 0), on: true }, Light { pin: Pin::new('B', 1), on: true }],
    buttons: [
        // B1, with a resistor to the supply.
        Button { pin: Pin::new('C', 13), pull: Pull::None, pressed: false },
        Button { pin: Pin::new('C', 10), pull: Pull::Up, pressed: false },
    ],
    lamps: [Light { pin: Pin::new('C', 0), on: true }, Light { pin: Pin::new('C', 1), on: true }],
    standby: Light { pin: Pin::new('B', 12), on: true },
    front_end: front_end::DEFAULT,
};
