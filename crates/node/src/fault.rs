//! Every fault of the node: its own, and those of the profiles. The faults of communication are the device's
//! ([`canopen::Fault`]).

use canopen::Condition;
use canopen::dictionary::Group;
use profiles::fault::{Fault, Flags, count, gather};

const fn fault(name: &'static str, code: u16, flags: Flags) -> Fault {
    Fault { name, condition: Condition::new(code), flags }
}

/// The clock of the sensor.
pub const SENSOR_CLOCK: Fault = fault("SensorClock", 0x5004, Flags::sensor(1));
/// The sensor did not start.
pub const SENSOR_BOOT: Fault = fault("SensorBoot", 0x5005, Flags::sensor(2));
/// The sensor's memory is corrupt.
pub const SENSOR_MEMORY: Fault = fault("SensorMemory", 0x5007, Flags::sensor(6));
/// A module did not initialise.
pub const MODULE_INITIALISATION: Fault = fault("ModuleInitialisation", 0x5001, Flags::system(0));
/// The image does not fit the hardware.
pub const HARDWARE_IDENTIFICATION: Fault = fault("HardwareIdentification", 0x5002, Flags::system(1));
/// The parameter store cannot be used.
pub const PARAMETER_STORE: Fault = fault("ParameterStore", 0x5003, Flags::system(2));
/// Node-ID and bit rate could not be loaded.
pub const BOOT_DATA: Fault = fault("BootData", 0x6301, Flags::system(3));
/// The node restarted without having been told to.
pub const UNEXPECTED_RESET: Fault = fault("UnexpectedReset", 0x6101, Flags::system(6));

/// Those that no profile finds.
const OWN: &[Fault] = &[
    SENSOR_CLOCK,
    SENSOR_BOOT,
    SENSOR_MEMORY,
    MODULE_INITIALISATION,
    HARDWARE_IDENTIFICATION,
    PARAMETER_STORE,
    BOOT_DATA,
    UNEXPECTED_RESET,
];

const LISTS: &[&[Fault]] = &[OWN, &profiles::FAULTS];

/// All faults, in the order of their numbers ([`canopen::Fault::Application`]).
pub static FAULTS: [Fault; count(LISTS)] = gather(LISTS);

/// What they look like on the bus, in the same order.
pub(crate) const CONDITIONS: [Condition; count(LISTS)] = {
    let faults: [Fault; count(LISTS)] = gather(LISTS);
    let mut conditions = [Condition::new(0); count(LISTS)];
    let mut i = 0;
    while i < conditions.len() {
        conditions[i] = faults[i].condition;
        i += 1;
    }
    conditions
};

/// The number of a fault.
pub(crate) fn number(fault: &Fault) -> Option<u8> {
    let mut numbered = (0..).zip(&FAULTS);
    numbered.find(|(_, known)| *known == fault).map(|(number, _)| number)
}

/// The flag of a storage group whose values could not be loaded. Without its calibration, the sensor runs with that of no
/// device.
pub(crate) fn flag_of(group: Group) -> Flags {
    match group {
        Group::Calibration => Flags::sensor(0),
        Group::Communication => Flags::system(4),
        Group::Application => Flags::system(5),
    }
}
