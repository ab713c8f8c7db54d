//! The EMCY message.

/// An emergency message: eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Message {
    /// Emergency error code; 0 reports that the last fault is gone.
    pub code: u16,
    /// Error register, object 1001h.
    pub register: u8,
    /// Manufacturer-specific error field.
    pub detail: [u8; 5],
}

impl Message {
    /// Any eight bytes are a message.
    #[must_use]
    pub const fn parse(frame: [u8; 8]) -> Message {
        let [low, high, register, detail @ ..] = frame;
        Message { code: u16::from_le_bytes([low, high]), register, detail }
    }

    /// The frame's data.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let ([low, high], detail) = (self.code.to_le_bytes(), self.detail);
        [low, high, self.register, detail[0], detail[1], detail[2], detail[3], detail[4]]
    }
}
