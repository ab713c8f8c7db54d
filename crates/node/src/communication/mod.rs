//! The communication segment of a dictionary, 1000h to 1FFFh, in the parts from which each personality puts its own
//! together: the rows in which personalities differ are functions.

mod objects;
mod pdos;
mod start_up;

pub(crate) use objects::{
    ERROR_REGISTER, ERRORS_AND_SYNC, SERVICES, STATUS_REGISTER, device_name, device_type, error_behaviour,
};
pub(crate) use pdos::{
    RPDOS, Tpdo, cob_id, count, event_timer, inhibit_time, off, slot, sync_start, tpdo_mappings, tpdos,
    transmission_type,
};
pub(crate) use start_up::START_UP;
