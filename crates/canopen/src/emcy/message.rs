//! The EMCY message.

/// An emergency message: eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Message {
    /// Emergency error code; 0 when no fault is active any more.
    pub code: u16,
    /// Error register, object 1001h.
    pub register: u8,
    /// Manufacturer-specific error field.
    pub detail: [u8; 5],
}

impl Message {
    /// Decodes a message. Any eight bytes are valid.
    #[must_use]
    pub const fn parse(frame: [u8; 8]) -> Message {
        let [low, high, register, detail @ ..] = frame;
        Message { code: u16::from_le_bytes([low, high]), register, detail }
    }

    /// The data of the frame.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let ([low, high], detail) = (self.code.to_le_bytes(), self.detail);
        [low, high, self.register, detail[0], detail[1], detail[2], detail[3], detail[4]]
    }
}
