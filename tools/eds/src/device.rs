//! The devices that the project builds, one for each personality.

use canopen::dictionary::Object as Row;
use profiles::Personality;

/// A device: what its data sheet is made from.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    /// File name of its data sheet.
    pub file_name: &'static str,
    /// What it is, in one line.
    pub description: &'static str,
    /// What the node is told to be.
    pub personality: Personality,
    /// Its dictionary.
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

/// All of them, in the order of the list of personalities.
pub static DEVICES: [Device; Personality::ALL.len()] = {
    let mut devices = [Device::of(Personality::ALL[0]); Personality::ALL.len()];
    let mut i = 0;
    while i < devices.len() {
        devices[i] = Device::of(Personality::ALL[i]);
        i += 1;
    }
    devices
};
