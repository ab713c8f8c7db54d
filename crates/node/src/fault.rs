//! The faults of the node itself, and what they look like on the bus. The faults of communication are the device's
//! ([`canopen::Fault`]).

use canopen::Condition;

/// A fault of the node. The discriminant is its place in [`Fault::CONDITIONS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// The clock of the sensor.
    SensorClock,
    /// The sensor did not start.
    SensorBoot,
    /// The sensor's signal is outside what an intact sensor can give.
    SensorBreak,
    /// The sensor's memory is corrupt.
    SensorMemory,
    /// The temperature input is at a rail of the converter.
    TemperatureRail,
    /// The pressure input is at a rail of the converter.
    PressureRail,
    /// An encoder does not answer, or not as one.
    EncoderBreak,
    /// The encoders take too much current.
    InputCurrent,
    /// The supply of the encoders is out of its limits.
    InputVoltage,
    /// A memory of the hardware is damaged.
    HardwareMemory,
    /// A module did not initialise.
    ModuleInitialisation,
    /// The image does not fit the hardware.
    HardwareIdentification,
    /// The parameter store cannot be used.
    ParameterStore,
    /// The node restarted without having been told to.
    UnexpectedReset,
    /// Node-ID and bit rate could not be loaded.
    BootData,
}

/// Bits of the error register (1001h): current and voltage.
const CURRENT: u8 = 1 << 1;
const VOLTAGE: u8 = 1 << 2;

impl Fault {
    /// All of them, in the order of their numbers.
    pub const ALL: [Fault; 15] = [
        Fault::SensorClock,
        Fault::SensorBoot,
        Fault::SensorBreak,
        Fault::SensorMemory,
        Fault::TemperatureRail,
        Fault::PressureRail,
        Fault::EncoderBreak,
        Fault::InputCurrent,
        Fault::InputVoltage,
        Fault::HardwareMemory,
        Fault::ModuleInitialisation,
        Fault::HardwareIdentification,
        Fault::ParameterStore,
        Fault::UnexpectedReset,
        Fault::BootData,
    ];

    /// What they look like on the bus, in the same order.
    pub const CONDITIONS: [Condition; 15] = {
        let mut conditions = [Condition::new(0); 15];
        let mut i = 0;
        while i < 15 {
            conditions[i] = Fault::ALL[i].condition();
            i += 1;
        }
        conditions
    };

    /// Emergency error code (CiA 301, table 26, CiA 406, 5.1, and the codes of the classes 50xxh, 61xxh, 63xxh and 80xxh that
    /// are the manufacturer's), bits of the error register, and the error field: 1 for the encoder's sensor, whose code is
    /// that of the pressure sensor.
    #[must_use]
    pub const fn condition(self) -> Condition {
        match self {
            Fault::SensorClock => Condition::new(0x5004),
            Fault::SensorBoot => Condition::new(0x5005),
            Fault::SensorBreak => Condition::new(0x5006),
            Fault::SensorMemory => Condition::new(0x5007),
            Fault::TemperatureRail => Condition::new(0x8001),
            Fault::PressureRail => Condition::new(0x8002),
            Fault::EncoderBreak => Condition { detail: [1, 0, 0, 0, 0], ..Condition::new(0x5006) },
            Fault::InputCurrent => Condition { register: CURRENT, ..Condition::new(0x2110) },
            Fault::InputVoltage => Condition { register: VOLTAGE, ..Condition::new(0x3110) },
            Fault::HardwareMemory => Condition::new(0x5100),
            Fault::ModuleInitialisation => Condition::new(0x5001),
            Fault::HardwareIdentification => Condition::new(0x5002),
            Fault::ParameterStore => Condition::new(0x5003),
            Fault::UnexpectedReset => Condition::new(0x6101),
            Fault::BootData => Condition::new(0x6301),
        }
    }

    /// Its place in the list.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}
