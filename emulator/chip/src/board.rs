//! What the board around the chip is made of.

pub use crate::spi::SsiFormat;

/// The board, and what was done to the chip in the factory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Board {
    /// Frequency of the clock on OSC_IN in hertz; `None` without one.
    pub hse: Option<u64>,
    /// Lines of the incremental encoder: a quarter of the counts in a revolution.
    pub encoder_lines: u32,
    /// The word of the absolute encoder, which answers on MISO of every SPI.
    pub ssi: SsiFormat,
    /// The 96 bits at 1FFF 7A10h.
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
