//! The devices that the project builds, one for each personality.

use canopen::dictionary::Object as Row;
use node::{Personality, combined, encoder, lift, pressure};

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

/// All of them.
pub static DEVICES: [Device; 4] = [
    Device {
        file_name: "pressure.eds",
        description: "Pressure and temperature transmitter, CiA 404",
        personality: Personality::Pressure,
        rows: &pressure::OBJECTS,
    },
    Device {
        file_name: "encoder.eds",
        description: "Encoder, CiA 406",
        personality: Personality::Encoder,
        rows: &encoder::OBJECTS,
    },
    Device {
        file_name: "combined.eds",
        description: "Encoder and transmitter in one, CiA 406 and CiA 404",
        personality: Personality::Combined,
        rows: &combined::OBJECTS,
    },
    Device {
        file_name: "lift.eds",
        description: "Car position, load measuring and panel units of a lift, CiA 417",
        personality: Personality::Lift,
        rows: &lift::OBJECTS,
    },
];
