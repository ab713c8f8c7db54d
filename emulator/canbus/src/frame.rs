//! A classic CAN frame.

pub use embedded_can::{ExtendedId, Id, StandardId};

/// A data or remote frame. Only valid frames can be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Frame {
    id: Id,
    remote: bool,
    len: u8,
    data: [u8; 8],
}

impl Frame {
    /// A data frame; `None` for more than eight bytes.
    pub fn data(id: impl Into<Id>, bytes: &[u8]) -> Option<Frame> {
        let mut data = [0; 8];
        data.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Frame { id: id.into(), remote: false, len: bytes.len() as u8, data })
    }

    /// A remote frame with a data length code; `None` above eight.
    pub fn remote(id: impl Into<Id>, dlc: u8) -> Option<Frame> {
        (dlc <= 8).then(|| Frame { id: id.into(), remote: true, len: dlc, data: [0; 8] })
    }

    /// The identifier.
    pub fn id(&self) -> Id {
        self.id
    }

    /// Whether this is a remote frame.
    pub fn is_remote(&self) -> bool {
        self.remote
    }

    /// The data length code.
    pub fn dlc(&self) -> u8 {
        self.len
    }

    /// The arbitration field as one number: of two frames on the wire, the one with the lower number wins.
    ///
    /// The bits of a base frame are identifier, RTR, IDE; those of an extended frame are base identifier, SRR, IDE,
    /// identifier extension, RTR. So a base frame wins over an extended one, and a data frame over a remote one (ISO
    /// 11898-1:2015, 10.4.2).
    pub fn arbitration(&self) -> u32 {
        match self.id {
            Id::Standard(id) => u32::from(id.as_raw()) << 21 | u32::from(self.remote) << 20,
            Id::Extended(id) => {
                let (base, extension) = (id.as_raw() >> 18, id.as_raw() & 0x3_FFFF);
                base << 21 | 0b11 << 19 | extension << 1 | u32::from(self.remote)
            }
        }
    }

    /// The data; empty for a remote frame.
    pub fn bytes(&self) -> &[u8] {
        if self.remote { &[] } else { &self.data[..usize::from(self.len)] }
    }
}

/// For codecs and drivers that know embedded-can only.
impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Frame> {
        Frame::data(id, data)
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Frame> {
        Frame::remote(id, u8::try_from(dlc).ok()?)
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.len.into()
    }

    fn data(&self) -> &[u8] {
        self.bytes()
    }
}
