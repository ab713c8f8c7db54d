//! Status flags: faults as they appear in 3000h, and their summary in 1002h.

use crate::Fault;
use canopen::dictionary::{Dictionary, Field, Group};

/// Where they are in the image of a dictionary that has them.
pub(crate) struct Fields {
    sensor: Field,
    internal: Field,
    system: Field,
    summary: Field,
}

impl Fields {
    /// Looks them up, during compilation.
    pub(crate) const fn new(d: &Dictionary) -> Fields {
        Fields {
            sensor: d.field(0x3000, 1),
            internal: d.field(0x3000, 2),
            system: d.field(0x3000, 3),
            summary: d.field(0x1002, 0),
        }
    }
}

/// The flags that are set, whether the dictionary shows them or not. They outlive a reset of the dictionary, as what they report does.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flags {
    sensor: u32,
    system: u32,
}

impl Flags {
    /// Sets or clears the flag of a fault; whether there is one.
    pub(crate) fn set(&mut self, fault: Fault, active: bool) -> bool {
        let (sensor, system) = bits(fault);
        self.set_bits(sensor, system, active);
        sensor | system != 0
    }

    /// Sets or clears the flag of a storage group whose values could not be loaded. Without its calibration, the sensor
    /// runs with that of no device.
    pub(crate) fn set_stored(&mut self, group: Group, active: bool) {
        let (sensor, system) = match group {
            Group::Calibration => (1, 0),
            Group::Communication => (0, 1 << 4),
            Group::Application => (0, 1 << 5),
        };
        self.set_bits(sensor, system, active);
    }

    fn set_bits(&mut self, sensor: u32, system: u32, active: bool) {
        self.sensor = if active { self.sensor | sensor } else { self.sensor & !sensor };
        self.system = if active { self.system | system } else { self.system & !system };
    }

    /// Writes the flags and their summary: bit 0 any sensor error, bit 1 any internal protocol error (there is none),
    /// bit 2 any system error.
    pub(crate) fn store(self, fields: &Fields, image: &mut [u8]) {
        let summary = u32::from(self.sensor != 0) | u32::from(self.system != 0) << 2;
        fields.sensor.store(image, self.sensor.to_le_bytes());
        fields.internal.store(image, [0; 4]);
        fields.system.store(image, self.system.to_le_bytes());
        fields.summary.store(image, summary.to_le_bytes());
    }
}

/// The bits of a fault in 3000h:1 and 3000h:3. Bits 0 to 6 are those of a pressure transmitter, the rest is the encoder's.
fn bits(fault: Fault) -> (u32, u32) {
    match fault {
        Fault::SensorClock => (1 << 1, 0),
        Fault::SensorBoot => (1 << 2, 0),
        Fault::TemperatureRail => (1 << 3, 0),
        Fault::PressureRail => (1 << 4, 0),
        Fault::SensorBreak => (1 << 5, 0),
        Fault::SensorMemory => (1 << 6, 0),
        Fault::EncoderBreak => (1 << 8, 0),
        Fault::InputCurrent => (1 << 9, 0),
        Fault::InputVoltage => (1 << 10, 0),
        Fault::ModuleInitialisation => (0, 1 << 0),
        Fault::HardwareIdentification => (0, 1 << 1),
        Fault::ParameterStore => (0, 1 << 2),
        Fault::BootData => (0, 1 << 3),
        Fault::UnexpectedReset => (0, 1 << 6),
        Fault::HardwareMemory => (0, 1 << 8),
    }
}
