//! CAN frames as CANopen uses them: 11-bit identifier, data or remote frame.

use crate::CanId;
use crate::copy::copy;

/// A CAN frame. This node uses the CAN base frame format only (CiA 301, 7.3.5).
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// CAN-ID, data length code and remote transmission request in one word, so that one comparison checks all three.
    head: u32,
    data: [u8; 8],
}

/// The position of the data length code in the head.
const LEN: u32 = 16;
/// The bit of the remote transmission request in the head.
const REMOTE: u32 = 1 << 24;

impl Frame {
    /// A data frame; `None` for an identifier above 7FFh or more than eight bytes.
    #[must_use]
    pub fn new(id: u16, bytes: &[u8]) -> Option<Frame> {
        let mut data = [0; 8];
        copy(data.get_mut(..bytes.len())?, bytes);
        let len = u8::try_from(bytes.len()).ok()?;
        Some(Frame::data_frame(CanId::new(id)?, len, data))
    }

    /// A data frame of the first `len` bytes, at most eight.
    #[inline(always)]
    #[allow(clippy::inline_always)] // Every caller knows the length or the CAN-ID, so less code than a call.
    pub(crate) fn data_frame(id: CanId, len: u8, data: [u8; 8]) -> Frame {
        Frame { head: head(id.get(), len), data }
    }

    /// The data bytes, followed by zeros.
    pub(crate) fn bytes(&self) -> [u8; 8] {
        self.data
    }

    /// The data, if this is a data frame of eight bytes with this identifier.
    #[inline]
    pub(crate) fn full(&self, id: impl Into<FullFrameId>) -> Option<&[u8; 8]> {
        (self.head == id.into().0).then_some(&self.data)
    }

    /// The data, followed by zeros, if this is a data frame of one to seven bytes with this identifier.
    pub(crate) fn short(&self, id: FullFrameId) -> Option<&[u8; 8]> {
        let is_short = matches!(self.len(), 1..=7) && !self.is_remote() && head(self.id(), 8) == id.0;
        is_short.then_some(&self.data)
    }

    /// A remote frame; `None` for an identifier above 7FFh or a length above eight.
    #[must_use]
    pub fn remote(id: u16, len: u8) -> Option<Frame> {
        (id <= 0x7FF && len <= 8).then_some(Frame { head: head(id, len) | REMOTE, data: [0; 8] })
    }

    /// The CAN-ID.
    #[must_use]
    pub fn id(&self) -> u16 {
        let [low, high, ..] = self.head.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Whether this is a remote frame (RTR).
    #[must_use]
    pub fn is_remote(&self) -> bool {
        self.head & REMOTE != 0
    }

    /// The data length code.
    #[must_use]
    pub fn len(&self) -> usize {
        let [_, _, len, _] = self.head.to_le_bytes();
        usize::from(len)
    }

    /// Whether the data length code is 0.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The data bytes; empty for a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.is_remote() { &[] } else { self.data.get(..self.len()).unwrap_or(&[]) }
    }
}

/// The head of data frames of eight bytes with one identifier, for a comparison with [`Frame::full`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct FullFrameId(u32);

impl From<CanId> for FullFrameId {
    fn from(id: CanId) -> FullFrameId {
        FullFrameId(head(id.get(), 8))
    }
}

/// The head of a data frame.
fn head(id: u16, len: u8) -> u32 {
    u32::from(id) | u32::from(len) << LEN
}

impl core::fmt::Debug for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut frame = f.debug_struct("Frame");
        frame.field("id", &self.id()).field("remote", &self.is_remote());
        frame.field("len", &self.len()).field("data", &self.data()).finish()
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Frame {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Frame {=u16:03x} remote {=bool} {=[u8]:02x}",
            self.id(),
            self.is_remote(),
            self.data()
        );
    }
}
