//! The frames that CANopen uses: 11-bit identifiers, data or remote.

use crate::CanId;
use crate::copy::copy;

/// A frame on the wire. CANopen services of this node use the CAN base frame format only (CiA 301, 7.3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    id: u16,
    remote: bool,
    len: u8,
    data: [u8; 8],
}

impl Frame {
    /// A data frame; `None` for an identifier above 7FFh or more than eight bytes.
    #[must_use]
    pub fn new(id: u16, bytes: &[u8]) -> Option<Frame> {
        let mut data = [0; 8];
        copy(data.get_mut(..bytes.len())?, bytes);
        let len = u8::try_from(bytes.len()).ok()?;
        (id <= 0x7FF).then_some(Frame { id, remote: false, len, data })
    }

    /// A data frame of the first `len` bytes, at most eight.
    pub(crate) fn data_frame(id: CanId, len: u8, data: [u8; 8]) -> Frame {
        Frame { id: id.get(), remote: false, len, data }
    }

    /// The data bytes, then zeros.
    pub(crate) fn bytes(&self) -> [u8; 8] {
        self.data
    }

    /// All eight bytes of a full data frame; `None` for any other.
    pub(crate) fn full(&self) -> Option<&[u8; 8]> {
        (self.len == 8 && !self.remote).then_some(&self.data)
    }

    /// A remote frame; `None` for an identifier above 7FFh or a length above eight.
    #[must_use]
    pub fn remote(id: u16, len: u8) -> Option<Frame> {
        (id <= 0x7FF && len <= 8).then_some(Frame { id, remote: true, len, data: [0; 8] })
    }

    /// The CAN-ID.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Whether it is a remote frame (RTR).
    #[must_use]
    pub fn is_remote(&self) -> bool {
        self.remote
    }

    /// The data length code.
    #[must_use]
    pub fn len(&self) -> usize {
        usize::from(self.len)
    }

    /// Whether it carries no data.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The data bytes; empty for a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.remote { &[] } else { self.data.get(..self.len()).unwrap_or(&[]) }
    }
}
