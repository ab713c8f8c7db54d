//! Objects of every device of the project, 1000h to 2FFFh, and functions for the parts of the communication segment in
//! which devices differ.

mod node;
mod objects;
mod pdos;
mod start_up;

pub use node::{
    LOST_EVENT_KINDS, LOST_EVENT_ROWS, LOST_EVENTS, PARAMETER_MEMORY, PARAMETER_MEMORY_ROWS, PERSONALITY,
    PROGRAM_AUTHORISATION, PROGRAM_AUTHORISATION_ROWS, PROGRAM_STATE, PROGRAM_STATE_ROWS, PROGRAM_TRIAL,
    PROGRAM_TRIAL_ROWS, SELF_TEST, SELF_TEST_KEY, SELF_TEST_ROW, TRANSFER_BUFFER, UPDATE_LOG, UPDATE_LOG_ROW,
    handles, personality,
};
pub use objects::{ERROR_REGISTER, ERRORS_AND_SYNC, SERVICES, device_name, device_type, error_behaviour};
pub(crate) use pdos::PDOS;
pub use pdos::{
    RPDOS, Tpdo, cob_id, count, event_timer, inhibit_time, off, slot, sync_start, tpdo_mappings, tpdos,
    transmission_type,
};
pub use start_up::START_UP;

use canopen::dictionary::Object;

/// The rows that every device has.
pub const COMMON: &[&[Object]] = &[
    &[ERROR_REGISTER],
    ERRORS_AND_SYNC,
    SERVICES,
    START_UP,
    LOST_EVENT_ROWS,
    PROGRAM_TRIAL_ROWS,
    PROGRAM_AUTHORISATION_ROWS,
    PARAMETER_MEMORY_ROWS,
    PROGRAM_STATE_ROWS,
    &[SELF_TEST_ROW, UPDATE_LOG_ROW, TRANSFER_BUFFER],
];
