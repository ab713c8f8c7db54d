//! The properties of the board around the chip.

pub use crate::plant::FrontEnd;
pub use crate::spi::{SsiFormat, SsiFormatError};

/// Number of buttons on the board.
pub const BUTTONS: usize = 2;

/// A button of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ButtonPin {
    pub(crate) port: usize,
    pub(crate) pin: u32,
    pub(crate) pressed: bool,
    pub(crate) released: Option<bool>,
}

impl ButtonPin {
    /// A button at a pin of a port (`'A'` to `'H'`), its level while it is pressed, and the one that a resistor of the board
    /// gives it otherwise.
    pub const fn new(port: char, pin: u32, pressed: bool, released: Option<bool>) -> ButtonPin {
        ButtonPin { port: port as usize - 'A' as usize, pin, pressed, released }
    }
}

/// The board, and the values that the factory has set in the chip.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// Frequency of the clock on OSC_IN in hertz; `None` without one.
    pub hse: Option<u64>,
    /// Whether that is a clock, as from an ST-LINK; otherwise it is a crystal.
    pub hse_is_clock: bool,
    /// Frequency of the LSI in hertz: 17,000 to 47,000 (DS10693, LSI oscillator characteristics).
    pub lsi: u32,
    /// The analogue front end.
    pub front_end: FrontEnd,
    /// The pin that puts the CAN transceiver to sleep, with the level that does.
    pub standby: (char, u32, bool),
    /// Lines of the incremental encoder: a revolution has four counts for each line.
    pub encoder_lines: u32,
    /// The format of the absolute encoder's word; the encoder answers on MISO of every SPI.
    pub ssi: SsiFormat,
    /// The 96 bits of the unique identifier at 1FFF 7A10h.
    pub unique_id: [u32; 3],
    /// The pins of the buttons.
    pub buttons: [ButtonPin; BUTTONS],
    /// Flash sectors that the option bytes protect against writing, bit 0 for sector 0.
    pub write_protected: u32,
}

impl Default for Board {
    /// A NUCLEO-F446RE, with 8 MHz from the ST-LINK, and an encoder of 1024 lines.
    fn default() -> Self {
        Self {
            hse: Some(8_000_000),
            hse_is_clock: true,
            lsi: 32_000,
            front_end: FrontEnd::default(),
            standby: ('B', 12, true),
            encoder_lines: 1024,
            ssi: SsiFormat::default(),
            buttons: [ButtonPin::new('C', 13, false, Some(true)), ButtonPin::new('C', 10, false, None)],
            unique_id: [0x0032_0041, 0x3336_5105, 0x3132_3839],
            write_protected: 0,
        }
    }
}
