//! Everything that the node can signal as a fault.

/// A fault. Each is set and cleared on its own, also those that exist several times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Communication parameters could not be loaded.
    CommunicationData,
    /// Application parameters could not be loaded.
    ApplicationData,
    /// The calibration could not be loaded.
    CalibrationData,
    /// A received frame was lost.
    Overrun,
    /// The CAN controller is error passive.
    ErrorPassive,
    /// The CAN controller was off the bus and is back.
    BusOffRecovered,
    /// SYNC does not come in its period.
    SyncMissing,
    /// A SYNC of another length than 1019h asks for.
    SyncLength,
    /// A multiplexed PDO for this node names an object that takes none.
    MpdoNotTaken,
    /// The heartbeat of a node is missing: entry of 1016h, from 0.
    Heartbeat(u8),
    /// An RPDO, counted from 0 among those of the dictionary, was shorter than its mapping and is not processed.
    RpdoTooShort(u8),
    /// An RPDO, counted the same way, was longer than its mapping.
    RpdoTooLong(u8),
    /// An RPDO, counted the same way, did not come in time.
    RpdoDeadline(u8),
}

/// The first bit of communication faults in a set of faults: from here on, all are.
const COMMUNICATION: u8 = 18;

impl Fault {
    /// Those that exist once, in the order of their bits.
    const SINGLE: [Fault; 24] = [
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
        Fault::CommunicationData,
        Fault::ApplicationData,
        Fault::CalibrationData,
        Fault::Overrun,
        Fault::ErrorPassive,
        Fault::BusOffRecovered,
        Fault::SyncMissing,
        Fault::SyncLength,
        Fault::MpdoNotTaken,
    ];

    /// Every fault that there is.
    pub fn all() -> impl Iterator<Item = Fault> {
        (0..u8::MAX).map_while(Fault::of_bit)
    }

    /// The fault of a bit in a set of faults.
    fn of_bit(bit: u8) -> Option<Fault> {
        Some(match bit {
            24..28 => Fault::Heartbeat(bit - 24),
            28..36 => Fault::RpdoTooShort(bit - 28),
            36..44 => Fault::RpdoTooLong(bit - 36),
            44..52 => Fault::RpdoDeadline(bit - 44),
            _ => return Fault::SINGLE.get(usize::from(bit)).copied(),
        })
    }

    /// Its bit in a set of faults; of those that exist several times that of the first.
    const fn first_bit(self) -> u8 {
        match self {
            Fault::SensorClock => 0,
            Fault::SensorBoot => 1,
            Fault::SensorBreak => 2,
            Fault::SensorMemory => 3,
            Fault::TemperatureRail => 4,
            Fault::PressureRail => 5,
            Fault::EncoderBreak => 6,
            Fault::InputCurrent => 7,
            Fault::InputVoltage => 8,
            Fault::HardwareMemory => 9,
            Fault::ModuleInitialisation => 10,
            Fault::HardwareIdentification => 11,
            Fault::ParameterStore => 12,
            Fault::UnexpectedReset => 13,
            Fault::BootData => 14,
            Fault::CommunicationData => 15,
            Fault::ApplicationData => 16,
            Fault::CalibrationData => 17,
            Fault::Overrun => 18,
            Fault::ErrorPassive => 19,
            Fault::BusOffRecovered => 20,
            Fault::SyncMissing => 21,
            Fault::SyncLength => 22,
            Fault::MpdoNotTaken => 23,
            Fault::Heartbeat(_) => 24,
            Fault::RpdoTooShort(_) => 28,
            Fault::RpdoTooLong(_) => 36,
            Fault::RpdoDeadline(_) => 44,
        }
    }

    /// Which one of those that exist several times, from 0.
    const fn instance(self) -> u8 {
        match self {
            Fault::Heartbeat(number) => number & 3,
            Fault::RpdoTooShort(number) | Fault::RpdoTooLong(number) | Fault::RpdoDeadline(number) => {
                number & 7
            }
            _ => 0,
        }
    }

    const fn bit(self) -> u8 {
        self.first_bit() + self.instance()
    }

    /// Emergency error code: CiA 301, table 26, CiA 406, 5.1, and the codes of the classes 50xxh, 61xxh, 63xxh and 80xxh
    /// that are the manufacturer's.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Fault::SensorClock => 0x5004,
            Fault::SensorBoot => 0x5005,
            Fault::SensorBreak | Fault::EncoderBreak => 0x5006,
            Fault::SensorMemory => 0x5007,
            Fault::TemperatureRail => 0x8001,
            Fault::PressureRail => 0x8002,
            Fault::InputCurrent => 0x2110,
            Fault::InputVoltage => 0x3110,
            Fault::HardwareMemory => 0x5100,
            Fault::ModuleInitialisation => 0x5001,
            Fault::HardwareIdentification => 0x5002,
            Fault::ParameterStore => 0x5003,
            Fault::UnexpectedReset => 0x6101,
            Fault::BootData => 0x6301,
            Fault::CommunicationData => 0x6302,
            Fault::ApplicationData => 0x6303,
            Fault::CalibrationData => 0x6300,
            Fault::Overrun => 0x8110,
            Fault::ErrorPassive => 0x8120,
            Fault::BusOffRecovered => 0x8140,
            Fault::SyncMissing => 0x8100,
            Fault::SyncLength => 0x8240,
            Fault::MpdoNotTaken => 0x8230,
            Fault::Heartbeat(_) => 0x8130,
            Fault::RpdoTooShort(_) => 0x8210,
            Fault::RpdoTooLong(_) => 0x8220,
            Fault::RpdoDeadline(_) => 0x8250,
        }
    }

    /// Manufacturer-specific error field: which one, from 1, of those that exist several times; 1 for the encoder's
    /// sensor, whose code is that of the pressure sensor.
    #[must_use]
    pub const fn detail(self) -> [u8; 5] {
        match self {
            Fault::Heartbeat(number)
            | Fault::RpdoTooShort(number)
            | Fault::RpdoTooLong(number)
            | Fault::RpdoDeadline(number) => [number.saturating_add(1), 0, 0, 0, 0],
            Fault::EncoderBreak => [1, 0, 0, 0, 0],
            _ => [0; 5],
        }
    }
}

/// A set of faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FaultSet(u64);

impl FaultSet {
    pub(crate) const EMPTY: FaultSet = FaultSet(0);

    /// Whether it is new.
    pub(crate) fn insert(&mut self, fault: Fault) -> bool {
        let before = self.0;
        self.0 |= 1 << fault.bit();
        self.0 != before
    }

    /// Whether it was there.
    pub(crate) fn remove(&mut self, fault: Fault) -> bool {
        let before = self.0;
        self.0 &= !(1 << fault.bit());
        self.0 != before
    }

    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(crate) fn iter(self) -> impl Iterator<Item = Fault> {
        Fault::all().filter(move |fault| self.contains(*fault))
    }

    /// The error register (1001h): bit 0 for any fault, bits 1 and 2 for current and voltage, bit 4 for communication.
    pub(crate) fn register(self) -> u8 {
        u8::from(self.0 != 0)
            | u8::from(self.contains(Fault::InputCurrent)) << 1
            | u8::from(self.contains(Fault::InputVoltage)) << 2
            | u8::from(self.0 >> COMMUNICATION != 0) << 4
    }

    fn contains(self, fault: Fault) -> bool {
        self.0 & 1 << fault.bit() != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_its_own_bit() {
        let mut set = FaultSet::default();
        assert!(Fault::all().all(|fault| set.insert(fault)));
        assert!(set.iter().eq(Fault::all()));
        assert!(Fault::all().all(|fault| set.remove(fault)));
        assert!(set.is_empty());
    }

    #[test]
    fn the_register_tells_communication_from_the_rest() {
        let mut set = FaultSet::default();
        assert_eq!(set.register(), 0);
        set.insert(Fault::SensorBreak);
        assert_eq!(set.register(), 0x01);
        for fault in Fault::all().filter(|fault| fault.code() >= 0x8100) {
            let mut set = FaultSet::default();
            set.insert(fault);
            assert_eq!(set.register(), 0x11, "{fault:?}");
        }
    }
}
