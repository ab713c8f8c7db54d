//! Everything that the node can signal as a fault.

/// A fault. The discriminant is its bit in a set of faults, the order has no other meaning.
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
    /// Communication parameters could not be loaded.
    CommunicationData,
    /// Application parameters could not be loaded.
    ApplicationData,
    /// A received frame was lost.
    Overrun,
    /// The CAN controller is error passive.
    ErrorPassive,
    /// The CAN controller was off the bus and is back.
    BusOffRecovered,
}

impl Fault {
    pub(crate) const ALL: [Fault; 16] = [
        Fault::SensorClock,
        Fault::SensorBoot,
        Fault::SensorBreak,
        Fault::SensorMemory,
        Fault::TemperatureRail,
        Fault::PressureRail,
        Fault::ModuleInitialisation,
        Fault::HardwareIdentification,
        Fault::ParameterStore,
        Fault::UnexpectedReset,
        Fault::BootData,
        Fault::CommunicationData,
        Fault::ApplicationData,
        Fault::Overrun,
        Fault::ErrorPassive,
        Fault::BusOffRecovered,
    ];

    /// Emergency error code: CiA 301, table 26, and the manufacturer's codes of the device classes 50xxh, 61xxh, 63xxh and 80xxh.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Fault::ModuleInitialisation => 0x5001,
            Fault::HardwareIdentification => 0x5002,
            Fault::ParameterStore => 0x5003,
            Fault::SensorClock => 0x5004,
            Fault::SensorBoot => 0x5005,
            Fault::SensorBreak => 0x5006,
            Fault::SensorMemory => 0x5007,
            Fault::UnexpectedReset => 0x6101,
            Fault::BootData => 0x6301,
            Fault::CommunicationData => 0x6302,
            Fault::ApplicationData => 0x6303,
            Fault::TemperatureRail => 0x8001,
            Fault::PressureRail => 0x8002,
            Fault::Overrun => 0x8110,
            Fault::ErrorPassive => 0x8120,
            Fault::BusOffRecovered => 0x8140,
        }
    }

    /// Its bits of the error register (1001h): the generic bit always, the communication bit for 81xxh and 82xxh.
    #[must_use]
    pub const fn register(self) -> u8 {
        match self.code() >> 8 {
            0x81 | 0x82 => 0x11,
            _ => 0x01,
        }
    }

    pub(crate) const fn bit(self) -> u32 {
        1 << self as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_its_own_bit_and_code() {
        for (i, a) in Fault::ALL.iter().enumerate() {
            assert!(Fault::ALL.iter().skip(i + 1).all(|b| a.code() != b.code() && a.bit() != b.bit()));
        }
    }
}
