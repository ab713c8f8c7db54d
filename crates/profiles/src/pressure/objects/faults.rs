//! Faults of the pressure and temperature inputs, and the flags that show all faults of the device: 3000h, 1002h.

use canopen::dictionary::{Dictionary, Field};
use canopen::emcy::Condition;

use crate::fault::{Fault, Flags};
use crate::pressure::Conditions;

/// The signal is outside the range of an intact sensor.
pub(crate) const SENSOR_BREAK: Fault =
    Fault { name: "SensorBreak", condition: Condition::new(0x5006), flags: Flags::sensor(5) };
/// The pressure input is at a rail of the converter.
const PRESSURE_RAIL: Fault =
    Fault { name: "PressureRail", condition: Condition::new(0x8002), flags: Flags::sensor(4) };
/// The temperature is not measured.
const TEMPERATURE_RAIL: Fault =
    Fault { name: "TemperatureRail", condition: Condition::new(0x8001), flags: Flags::sensor(3) };

/// All faults of these inputs.
pub const FAULTS: &[Fault] = &[SENSOR_BREAK, PRESSURE_RAIL, TEMPERATURE_RAIL];

impl Conditions {
    /// Calls `each` with every fault and whether the fault is present.
    pub(super) fn faults(self, each: &mut impl FnMut(&'static Fault, bool)) {
        each(&SENSOR_BREAK, self.sensor_break);
        each(&PRESSURE_RAIL, self.pressure_rail);
        each(&TEMPERATURE_RAIL, self.temperature_rail);
    }
}

/// The places of the flags.
#[derive(Debug)]
pub(super) struct FlagFields {
    sensor: Field,
    internal: Field,
    system: Field,
    summary: Field,
    register: Field,
}

impl FlagFields {
    pub(super) const fn new(d: &Dictionary) -> FlagFields {
        FlagFields {
            sensor: d.field(0x3000, 1),
            internal: d.field(0x3000, 2),
            system: d.field(0x3000, 3),
            summary: d.field(0x1002, 0),
            register: d.field(0x1001, 0),
        }
    }

    /// Writes the flags and their summary. Bit 0: any sensor error. Bit 1: any error of the internal protocol, never
    /// set. Bit 2: any error at all, including communication errors, which have no flags.
    pub(super) fn show(&self, flags: Flags, image: &mut [u8]) {
        let is_error = flags != Flags::NONE || self.register.u8(image) != 0;
        let summary = u32::from(flags.sensor != 0) | u32::from(is_error) << 2;
        self.sensor.store(image, flags.sensor.to_le_bytes());
        self.internal.store(image, [0; 4]);
        self.system.store(image, flags.system.to_le_bytes());
        self.summary.store(image, summary.to_le_bytes());
    }
}
