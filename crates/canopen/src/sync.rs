//! SYNC consumer (CiA 301, 7.2.5): which frames are the SYNC.

use crate::sdo::Abort;
use crate::{CanId, CobId, Frame};

/// Recognises the SYNC message.
#[derive(Debug)]
pub(crate) struct Consumer {
    id: CanId,
}

impl Consumer {
    /// The default of 1005h.
    pub(crate) const fn new() -> Consumer {
        Consumer { id: CanId::of_service(0x080, 0) }
    }

    /// Takes the COB-ID of 1005h.
    pub(crate) fn configure(&mut self, value: u32) {
        if let Some(cob_id) = CobId::parse(value) {
            self.id = cob_id.id;
        }
    }

    pub(crate) fn id(&self) -> CanId {
        self.id
    }

    /// A SYNC is a data frame; a remote frame with its identifier is none.
    pub(crate) fn accepts(&self, frame: &Frame) -> bool {
        frame.id() == self.id.get() && !frame.is_remote()
    }
}

/// Checks a new value of 1005h. Bit 30 would make the node a producer, which it is not; bit 31 has no meaning.
pub(crate) fn check_cob_id(value: u32) -> Result<(), Abort> {
    let cob_id = CobId::parse(value).ok_or(Abort::InvalidValue)?;
    if cob_id.bit30 || cob_id.id.is_restricted() { Err(Abort::InvalidValue) } else { Ok(()) }
}
