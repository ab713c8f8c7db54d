//! The time stamp (CiA 301, 7.2.6): the time of day in a message of six bytes.

use crate::sdo::Abort;
use crate::{CanId, CobId, Frame};

/// The most milliseconds that the 28 bits of a time of day can have.
const MILLISECONDS: u32 = 0x0FFF_FFFF;

/// `TIME_OF_DAY` (CiA 301, 7.1.6.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TimeOfDay {
    /// Days since 1984-01-01.
    pub days: u16,
    /// Milliseconds after midnight, at most 28 bits.
    pub milliseconds: u32,
}

impl TimeOfDay {
    /// Decodes the data of a message. The four highest bits of the milliseconds are reserved and ignored.
    #[must_use]
    pub const fn parse([a, b, c, d, low, high]: [u8; 6]) -> TimeOfDay {
        let milliseconds = u32::from_le_bytes([a, b, c, d]) & MILLISECONDS;
        TimeOfDay { days: u16::from_le_bytes([low, high]), milliseconds }
    }

    /// The data of a message.
    #[must_use]
    pub const fn encode(self) -> [u8; 6] {
        let [a, b, c, d] = (self.milliseconds & MILLISECONDS).to_le_bytes();
        let [low, high] = self.days.to_le_bytes();
        [a, b, c, d, low, high]
    }
}

/// Whether and with which CAN-ID the time stamp is received and sent.
#[derive(Debug)]
pub(crate) struct Service {
    cob_id: Option<CobId>,
}

impl Service {
    pub(crate) const fn new() -> Service {
        Service { cob_id: None }
    }

    /// Takes the value of 1012h.
    pub(crate) fn configure(&mut self, value: u32) {
        self.cob_id = CobId::parse(value);
    }

    /// The CAN-ID to receive: bit 31 of 1012h is set.
    pub(crate) fn consumed(&self) -> Option<CanId> {
        self.cob_id.filter(|cob_id| cob_id.bit31).map(|cob_id| cob_id.id)
    }

    /// The time in a received frame, if it is a time stamp.
    pub(crate) fn take(&self, frame: &Frame) -> Option<TimeOfDay> {
        let is_own = self.consumed().is_some_and(|id| id.get() == frame.id());
        let data = frame.data().try_into().ok().filter(|_| is_own)?;
        Some(TimeOfDay::parse(data))
    }

    /// The frame with a time: bit 30 of 1012h is set.
    pub(crate) fn frame(&self, time: TimeOfDay) -> Option<Frame> {
        let cob_id = self.cob_id.filter(|cob_id| cob_id.bit30)?;
        let mut data = [0; 8];
        for (to, from) in data.iter_mut().zip(time.encode()) {
            *to = from;
        }
        Some(Frame::data_frame(cob_id.id, 6, data))
    }
}

/// Checks a new value of 1012h: the CAN-ID can change only while the time stamp is neither received nor sent.
pub(crate) fn check_cob_id(old: u32, new: u32) -> Result<(), Abort> {
    let new = CobId::parse(new).filter(|new| !new.id.is_restricted()).ok_or(Abort::InvalidValue)?;
    let moves = CobId::parse(old).is_some_and(|old| (old.bit30 || old.bit31) && old.id != new.id);
    if moves { Err(Abort::InvalidValue) } else { Ok(()) }
}
