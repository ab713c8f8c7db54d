//! Checks of a write to a COB-ID.

use super::Abort;
use crate::{CanId, CobId};

impl CobId {
    /// Checks a new value of a COB-ID that bit 31 disables (EMCY, SDO): the CAN-ID of an enabled service does not
    /// change, and must not be restricted.
    pub(crate) fn check_change(old: u32, new: u32) -> Result<(), Abort> {
        let id = CobId::check_place(old, new)?;
        if id.is_some_and(CanId::is_restricted) { Err(Abort::InvalidValue) } else { Ok(()) }
    }

    /// As [`check_change`](CobId::check_change), for a service that can use a restricted CAN-ID. Returns the CAN-ID of an
    /// enabled service.
    pub(crate) fn check_place(old: u32, new: u32) -> Result<Option<CanId>, Abort> {
        let is_enabled = |value: u32| value >> 31 == 0;
        let moves = is_enabled(old) && is_enabled(new) && old != new;
        match CobId::enabled(new & !(1 << 31)).filter(|_| !moves) {
            Some(id) => Ok(Some(id).filter(|_| is_enabled(new))),
            None => Err(Abort::InvalidValue),
        }
    }
}
