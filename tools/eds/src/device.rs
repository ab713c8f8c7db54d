//! The devices that the project builds, one for each personality.

use canopen::dictionary::Object as Row;
use profiles::Personality;

/// A device and the source of its data sheet.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    /// File name of its data sheet.
    pub file_name: &'static str,
    /// A description of the device in one line.
    pub description: &'static str,
    /// The personality that the node is set to.
    pub personality: Personality,
    /// The dictionary of the device.
    pub rows: &'static [Row],
}

impl Device {
    /// The device of a personality.
    #[must_use]
    pub const fn of(personality: Personality) -> Device {
        Device {
            file_name: personality.file_name(),
            description: personality.description(),
            personality,
            rows: personality.rows(),
        }
    }
}

/// All devices, in the order of the list of personalities.
pub static DEVICES: [Device; Personality::ALL.len()] = {
    let mut devices = [Device::of(Personality::ALL[0]); Personality::ALL.len()];
    let mut i = 0;
    while i < devices.len() {
        devices[i] = Device::of(Personality::ALL[i]);
        i += 1;
    }
    devices
};
