//! Status flags: faults as they appear in 3000h, and their summary in 1002h.

use crate::pressure::DICTIONARY;
use canopen::dictionary::Field;
use canopen::emcy::Fault;

const SENSOR: Field = DICTIONARY.field(0x3000, 1);
const INTERNAL: Field = DICTIONARY.field(0x3000, 2);
const SYSTEM: Field = DICTIONARY.field(0x3000, 3);
const SUMMARY: Field = DICTIONARY.field(0x1002, 0);

/// The flags that are set. They outlive a reset of the dictionary, as what they report does.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flags {
    sensor: u32,
    system: u32,
}

impl Flags {
    /// Sets or clears the flag of a fault. `false` for a fault that has none: those of communication.
    pub(crate) fn set(&mut self, fault: Fault, active: bool) -> bool {
        let (sensor, system) = bits(fault);
        self.sensor = if active { self.sensor | sensor } else { self.sensor & !sensor };
        self.system = if active { self.system | system } else { self.system & !system };
        sensor | system != 0
    }

    /// Writes the flags and their summary: bit 0 any sensor error, bit 1 any internal protocol error (there is none),
    /// bit 2 any system error.
    pub(crate) fn store(self, image: &mut [u8]) {
        let summary = u32::from(self.sensor != 0) | u32::from(self.system != 0) << 2;
        SENSOR.store(image, self.sensor.to_le_bytes());
        INTERNAL.store(image, [0; 4]);
        SYSTEM.store(image, self.system.to_le_bytes());
        SUMMARY.store(image, summary.to_le_bytes());
    }
}

/// The bits of a fault in 3000h:1 and 3000h:3.
fn bits(fault: Fault) -> (u32, u32) {
    match fault {
        Fault::SensorClock => (1 << 1, 0),
        Fault::SensorBoot => (1 << 2, 0),
        Fault::TemperatureRail => (1 << 3, 0),
        Fault::PressureRail => (1 << 4, 0),
        Fault::SensorBreak => (1 << 5, 0),
        Fault::SensorMemory => (1 << 6, 0),
        Fault::ModuleInitialisation => (0, 1 << 0),
        Fault::HardwareIdentification => (0, 1 << 1),
        Fault::ParameterStore => (0, 1 << 2),
        Fault::BootData => (0, 1 << 3),
        Fault::CommunicationData => (0, 1 << 4),
        Fault::ApplicationData => (0, 1 << 5),
        Fault::UnexpectedReset => (0, 1 << 6),
        _ => (0, 0),
    }
}
