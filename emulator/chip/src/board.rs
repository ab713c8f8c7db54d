//! The properties of the board around the chip.

pub use crate::spi::SsiFormat;

/// The board, and the values that the factory has set in the chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Board {
    /// Frequency of the clock on OSC_IN in hertz; `None` without one.
    pub hse: Option<u64>,
    /// Lines of the incremental encoder: a revolution has four counts for each line.
    pub encoder_lines: u32,
    /// The format of the absolute encoder's word; the encoder answers on MISO of every SPI.
    pub ssi: SsiFormat,
    /// The 96 bits of the unique identifier at 1FFF 7A10h.
    pub unique_id: [u32; 3],
    /// Flash sectors that the option bytes protect against writing, bit 0 for sector 0.
    pub write_protected: u32,
}

impl Default for Board {
    /// A NUCLEO-F446RE, with 8 MHz from the ST-LINK, and an encoder of 1024 lines.
    fn default() -> Self {
        Self {
            hse: Some(8_000_000),
            encoder_lines: 1024,
            ssi: SsiFormat::default(),
            unique_id: [0x0032_0041, 0x3336_5105, 0x3132_3839],
            write_protected: 0,
        }
    }
}
