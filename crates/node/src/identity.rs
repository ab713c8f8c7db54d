//! The identity of the device as the parameter store has it, and whether the record could be read.

use embedded_storage::nor_flash::ReadNorFlash;
use storage::{DeviceRecord, Health, View};

use crate::Fault;
use crate::fault::{BOOT_DATA, OLDER_BOOT_DATA};

/// The device record as the node starts with it.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Node-ID, bit rate and personality; `None` where nothing is stored or nothing can be read.
    pub record: Option<DeviceRecord>,
    /// The fault to be told once the node has booted up (EMCY 6301h); `None` where the record is what was stored last.
    pub fault: Option<&'static Fault>,
}

impl Identity {
    /// Reads the device record.
    #[inline(never)]
    pub fn read<F: ReadNorFlash>(view: &mut View<F>) -> Identity {
        let record = view.device().ok().flatten();
        let is_stored = !matches!(view.load(DeviceRecord::NUMBER, &mut [0; DeviceRecord::ROOM]), Ok(None));
        let fault = match (view.health(DeviceRecord::NUMBER), record) {
            (Health::Good, Some(_)) => None,
            (Health::Good, None) => is_stored.then_some(&BOOT_DATA),
            (_, None) => Some(&BOOT_DATA),
            (_, Some(_)) => Some(&OLDER_BOOT_DATA),
        };
        Identity { record, fault }
    }
}
