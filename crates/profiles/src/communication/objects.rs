//! Communication profile objects of every device of the project, 1000h to 1029h (CiA 301).

use canopen::dictionary::Object;
use canopen::objects;

pub use objects::device_name;

/// 1000h, device type.
///
/// # Panics
/// During compilation, for a code of more than 32 bits.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // The cut-off bits are checked.
pub const fn device_type(code: i64) -> Object {
    assert!(code as u32 as i64 == code, "a device type has 32 bits");
    objects::device_type(code as u32)
}

/// 1001h, error register.
pub const ERROR_REGISTER: Object = objects::error_register();

/// 1003h to 1007h and 1019h.
pub const ERRORS_AND_SYNC: &[Object] = canopen::rows!(objects::error_field::<11>(), objects::sync_consumer());

/// 1009h to 1018h. The node fills in versions and identity.
pub const SERVICES: &[Object] = canopen::rows!(
    [objects::hardware_version(""), objects::software_version("")],
    objects::store_parameters(),
    objects::restore_parameters(),
    objects::emergency(),
    objects::heartbeat_consumer::<5>(),
    [objects::heartbeat_producer(1000)],
    objects::identity(0, 0, 0),
);

/// 1029h. `device_error`: default reaction to a fault of the device, 0 pre-operational, 1 no change, 2 stopped.
///
/// # Panics
/// During compilation, for any other number.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // The value is 0 to 2.
pub const fn error_behaviour(device_error: i64) -> [Object; 3] {
    assert!(0 <= device_error && device_error <= 2, "1029h:2 takes 0 to 2");
    objects::error_behaviour(device_error as u8)
}
