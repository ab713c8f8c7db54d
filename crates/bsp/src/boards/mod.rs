//! The boards: one file each, with everything in which it differs from the others. A feature of the crate chooses it.
//!
//! The pins of CAN (PB8, PB9), SSI (PB13, PB14), the encoder (PB5 to PB7) and the analogue inputs (PA0, PA1, PC2) are those
//! of the peripherals and the same on all boards. docs/porting.md describes how a board is added.

mod black_f407ve;
mod front_end;
mod nucleo_f446re;
mod weact_f405rg;

pub use front_end::{Divider, FrontEnd, Thermistor, Transducer};

/// The boards that images can be built for, by the name of their feature.
pub const ALL: [(&str, &Board); 3] = [
    ("nucleo-f446re", &nucleo_f446re::BOARD),
    ("weact-f405rg", &weact_f405rg::BOARD),
    ("black-f407ve", &black_f407ve::BOARD),
];

/// Clock of APB1 on all boards, hence of bxCAN, in hertz.
pub const APB1_HZ: u32 = 36_000_000;

/// The board of this image.
#[cfg(feature = "nucleo-f446re")]
pub const BOARD: Board = nucleo_f446re::BOARD;
/// The board of this image.
#[cfg(feature = "weact-f405rg")]
pub const BOARD: Board = weact_f405rg::BOARD;
/// The board of this image.
#[cfg(feature = "black-f407ve")]
pub const BOARD: Board = black_f407ve::BOARD;

/// A board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Board {
    /// Object 1009h.
    pub name: &'static str,
    /// The chip.
    pub chip: Chip,
    /// The source of the clock.
    pub oscillator: Oscillator,
    /// The status LED.
    pub led: Light,
    /// The indicators of CiA 303-3: RUN, green, and ERROR, red. The boards have none: they are LEDs of one's own.
    pub indicators: [Light; 2],
    /// The buttons of a lift's panel.
    pub buttons: [Button; 2],
    /// The lamps of a lift's panel.
    pub lamps: [Light; 2],
    /// The pin that puts the CAN transceiver to sleep (STB, RS or S), with the level that does. Without such a pin, one
    /// that is not connected.
    pub standby: Light,
    /// The circuits of the analogue inputs.
    pub front_end: FrontEnd,
}

/// A chip, with everything in which it differs from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// The name, without package and size of the flash.
    pub name: &'static str,
    /// The device in `DBGMCU_IDCODE` (RM0390, 33.6.1; RM0090, 38.6.1).
    pub device: u32,
    /// The ADC channel of the temperature sensor (RM0390, 13.10; RM0090, 13.10).
    pub temperature_channel: u8,
    /// Whether revision A can prefetch (ES0182: ART accelerator prefetch queue instruction is not supported).
    pub revision_a_prefetches: bool,
}

impl Chip {
    /// STM32F446.
    pub const F446: Chip =
        Chip { name: "stm32f446", device: 0x421, temperature_channel: 18, revision_a_prefetches: true };
    /// STM32F405.
    pub const F405: Chip =
        Chip { name: "stm32f405", device: 0x413, temperature_channel: 16, revision_a_prefetches: false };
    /// STM32F407: the F405 with Ethernet and a camera interface.
    pub const F407: Chip = Chip { name: "stm32f407", ..Chip::F405 };
}

/// A source of the clock at `OSC_IN`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Oscillator {
    /// The frequency in hertz: an even number of megahertz from 4 to 26.
    pub hertz: u32,
    /// Whether the board feeds a clock into `OSC_IN`, as the ST-LINK of a NUCLEO does; otherwise it has a crystal.
    pub is_bypassed: bool,
}

/// A pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin {
    /// The port, A to H.
    pub port: char,
    /// The number, 0 to 15.
    pub number: u8,
}

/// A pull resistor of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pull {
    /// None: the board has one.
    None,
    /// To the supply.
    Up,
    /// To ground.
    Down,
}

/// A button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Button {
    /// The pin.
    pub pin: Pin,
    /// The pull resistor for a released button.
    pub pull: Pull,
    /// The level of a pressed button.
    pub pressed: bool,
}

/// An LED, or a lamp with its driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Light {
    /// The pin.
    pub pin: Pin,
    /// The level that switches it on.
    pub on: bool,
}

/// The pins of the peripherals and of the debug port, as bits of a port.
const FIXED: [(char, u16); 3] =
    [('A', 0b1110_0000_0000_0011), ('B', 0b0110_0011_1111_1000), ('C', 0b0000_0000_0000_0100)];

impl Board {
    /// The pins of the board at a port, as bits.
    #[must_use]
    pub const fn pins(&self, port: char) -> u16 {
        let [first, second] = self.buttons;
        let [left, right] = self.lamps;
        let [run, error] = self.indicators;
        let own = self.led.pin.bit(port) | first.pin.bit(port) | second.pin.bit(port);
        let lamps = left.pin.bit(port) | right.pin.bit(port);
        let indicators = run.pin.bit(port) | error.pin.bit(port);
        own | lamps | indicators | self.standby.pin.bit(port) | fixed(port)
    }
}

/// The pins at a port that are the same on all boards.
#[must_use]
pub const fn fixed(port: char) -> u16 {
    let (mut at, mut pins) = (0, 0);
    while at < FIXED.len() {
        if FIXED[at].0 == port {
            pins |= FIXED[at].1;
        }
        at += 1;
    }
    pins
}

impl Pin {
    /// A pin by its port and its number.
    #[must_use]
    pub const fn new(port: char, number: u8) -> Pin {
        Pin { port, number }
    }

    /// The pin as a bit of a port; 0 at another port.
    #[must_use]
    pub const fn bit(self, port: char) -> u16 {
        if self.port == port { 1 << self.number } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_of_a_board_has_one_function() {
        for (feature, board) in ALL {
            let lights = [[board.led, board.standby], board.lamps, board.indicators];
            let lights = lights.into_iter().flatten().map(|light| light.pin);
            let buttons = board.buttons.map(|button| button.pin);
            let mut taken = [None; 8];
            for (place, pin) in lights.chain(buttons).enumerate() {
                assert!(('A'..='H').contains(&pin.port) && pin.number < 16, "{feature}: {pin:?}");
                assert_eq!(
                    pin.bit(pin.port) & fixed(pin.port),
                    0,
                    "{feature}: {pin:?} belongs to a peripheral"
                );
                assert!(!taken.contains(&Some(pin)), "{feature}: {pin:?} twice");
                taken[place] = Some(pin);
            }
            let of_ports: u32 = ('A'..='H').map(|port| board.pins(port).count_ones()).sum();
            let of_all: u32 = ('A'..='H').map(|port| fixed(port).count_ones()).sum();
            assert_eq!(of_ports, of_all + 8, "{feature}");
        }
    }

    /// VDDA is 3.3 V; an input has at most this voltage.
    #[test]
    fn no_input_is_above_vdda() {
        for (feature, board) in ALL {
            assert!(board.front_end.highest_input() <= 3300, "{feature}: {:?}", board.front_end);
        }
        let direct = Divider { upper: 0, lower: 15_000 };
        let wrong = FrontEnd { divider: direct, ..ALL[0].1.front_end };
        assert_eq!(wrong.highest_input(), 5000);
    }

    #[test]
    fn every_oscillator_can_be_divided_to_two_megahertz() {
        for (feature, board) in ALL {
            let hertz = board.oscillator.hertz;
            assert!(
                hertz.is_multiple_of(2_000_000) && (4_000_000..=26_000_000).contains(&hertz),
                "{feature}: {hertz}"
            );
        }
    }
}
