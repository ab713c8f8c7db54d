//! One GPIO port (RM0390 section 7.4, RM0090 section 8.4).

use crate::register::{Plain, RegisterFile, field, flag};

const MODER: u32 = 0x00;
const OTYPER: u32 = 0x04;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;

const ALL: u32 = u32::MAX;

macro_rules! port {
    ($mode:expr, $speed:expr, $pull:expr) => {
        &[
            Plain::new(MODER, $mode, ALL),
            Plain::new(OTYPER, 0, 0xFFFF),
            Plain::new(OSPEEDR, $speed, ALL),
            Plain::new(PUPDR, $pull, ALL),
            Plain::new(ODR, 0, 0xFFFF),
            Plain::new(AFRL, 0, ALL),
            Plain::new(AFRH, 0, ALL),
        ]
    };
}

/// After a reset the debug pins of ports A and B belong to the debug port.
const PORT_A: &[Plain] = port!(0xA800_0000, 0x0C00_0000, 0x6400_0000);
const PORT_B: &[Plain] = port!(0x0000_0280, 0x0000_00C0, 0x0000_0100);
const OTHER: &[Plain] = port!(0, 0, 0);

/// The levels that the outside world drives on the pins of a port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Outside {
    driven: u16,
    levels: u16,
}

impl Outside {
    /// Drives one pin, or releases it.
    pub(crate) fn set(&mut self, pin: u32, level: Option<bool>) {
        self.driven = self.driven & !(1 << pin) | u16::from(level.is_some()) << pin;
        self.levels = self.levels & !(1 << pin) | u16::from(level == Some(true)) << pin;
    }

    pub(crate) fn level(self, pin: u32) -> Option<bool> {
        (self.driven >> pin & 1 != 0).then_some(self.levels >> pin & 1 != 0)
    }
}

/// The function of a pin that MODER selects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Input,
    Output,
    Alternate,
    Analog,
}

#[derive(Clone)]
pub(crate) struct Gpio {
    plain: RegisterFile,
}

impl Gpio {
    /// Port 0 is GPIOA.
    pub(crate) fn new(port: usize) -> Self {
        let layout = match port {
            0 => PORT_A,
            1 => PORT_B,
            _ => OTHER,
        };
        Self { plain: RegisterFile::new(layout) }
    }

    pub(crate) fn read(&self, offset: u32, outside: Outside) -> Option<u32> {
        match offset {
            IDR => Some((0..16).fold(0, |word, pin| word | flag(self.level(pin, outside), pin))),
            // Write only; reads as 0.
            BSRR => Some(0),
            _ => self.plain.read(offset),
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            IDR => Some(()),
            BSRR => {
                // For a pin with a set and a reset bit, the set bit wins.
                let output = self.plain.get(ODR) & !(value >> 16) | value & 0xFFFF;
                self.plain.write(ODR, output)
            }
            _ => self.plain.write(offset, value),
        }
    }

    /// The level that the chip drives on a pin as a general purpose output; `None` when the pin is no output.
    pub(crate) fn output(&self, pin: u32) -> Option<bool> {
        let high = field(self.plain.get(ODR), pin, 1) != 0;
        let open_drain = field(self.plain.get(OTYPER), pin, 1) != 0;
        (self.mode(pin) == Mode::Output && !(open_drain && high)).then_some(high)
    }

    /// Whether the pin is switched to the alternate function `function`.
    pub(crate) fn alternate(&self, pin: u32, function: u32) -> bool {
        let register = if pin < 8 { AFRL } else { AFRH };
        self.mode(pin) == Mode::Alternate && field(self.plain.get(register), pin % 8 * 4, 4) == function
    }

    /// Whether a pin is switched to its analogue function.
    pub(crate) fn is_analogue(&self, pin: u32) -> bool {
        self.mode(pin) == Mode::Analog
    }

    /// Whether a pin has the lowest output speed.
    pub(crate) fn is_slowest(&self, pin: u32) -> bool {
        field(self.plain.get(OSPEEDR), pin * 2, 2) == 0
    }

    /// The level at the input stage.
    pub(crate) fn level(&self, pin: u32, outside: Outside) -> bool {
        if self.mode(pin) == Mode::Analog {
            return false;
        }
        let pulled_up = field(self.plain.get(PUPDR), pin * 2, 2) == 1;
        self.output(pin).or(outside.level(pin)).unwrap_or(pulled_up)
    }

    fn mode(&self, pin: u32) -> Mode {
        match field(self.plain.get(MODER), pin * 2, 2) {
            0 => Mode::Input,
            1 => Mode::Output,
            2 => Mode::Alternate,
            _ => Mode::Analog,
        }
    }
}
