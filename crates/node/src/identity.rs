//! The identity of the device in the parameter store, and whether the record could be read.

use embedded_storage::nor_flash::ReadNorFlash;
use storage::{DeviceRecord, Health, View};

use crate::Fault;
use crate::device_value::DeviceValue;
use crate::fault::{BOOT_DATA, OLDER_BOOT_DATA};

/// The device record at the start of the node.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Node-ID, bit rate and personality; `None` if nothing is stored or nothing can be read.
    pub record: Option<DeviceRecord>,
    /// The fault to be reported after the boot-up message (EMCY 6301h); `None` if the last stored record was read.
    pub fault: Option<&'static Fault>,
}

impl Identity {
    /// Reads the device record.
    #[inline(never)]
    pub fn read<F: ReadNorFlash>(view: &mut View<F>) -> Identity {
        let record = view.device().ok().flatten();
        let is_stored = DeviceValue::view(view).has_device();
        let fault = match (view.health(DeviceRecord::NUMBER), record) {
            (Health::Good, Some(_)) => None,
            (Health::Good, None) => is_stored.then_some(&BOOT_DATA),
            (_, None) => Some(&BOOT_DATA),
            (_, Some(_)) => Some(&OLDER_BOOT_DATA),
        };
        Identity { record, fault }
    }
}
