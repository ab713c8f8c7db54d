//! All faults of the node: its own and those of the profiles. Faults of the communication belong to the device
//! ([`canopen::Fault`]).

use canopen::dictionary::Group;
use canopen::{Condition, ErrorClass};
use profiles::fault::{Fault, Flags, count, gather};

const fn fault(name: &'static str, code: u16, flags: Flags) -> Fault {
    Fault { name, condition: Condition::new(code), flags }
}

/// The parameter store cannot be used.
pub const PARAMETER_STORE: Fault = fault("ParameterStore", 0x5003, Flags::system(2));
/// The device record (node-ID, bit rate, personality) could not be read, so the defaults are in use.
pub const BOOT_DATA: Fault = with_detail("BootData", DEFAULTS_HOLD);
/// The newest device record could not be read, so the record before is in use.
pub const OLDER_BOOT_DATA: Fault = with_detail("OlderBootData", OLDER_HOLDS);
/// The node was reset without a command.
pub const UNEXPECTED_RESET: Fault = fault("UnexpectedReset", 0x6101, Flags::system(6));

/// A new program has failed its trial, and the previous program was restored (2002h).
pub const PROGRAM_TAKEN_BACK: Fault = fault("ProgramTakenBack", 0x6102, Flags::NONE);

/// First byte of the error field of an EMCY about stored data, as in [`canopen::Fault::OlderData`] and
/// [`canopen::Fault::StoredData`].
const OLDER_HOLDS: u8 = 1;
const DEFAULTS_HOLD: u8 = 2;

const fn with_detail(name: &'static str, holds: u8) -> Fault {
    let condition = Condition { detail: [holds, 0, 0, 0, 0], ..Condition::new(0x6301) };
    Fault { name, condition, flags: Flags::system(3) }
}

/// The node's own faults, which no profile detects.
const OWN: &[Fault] = &[PARAMETER_STORE, BOOT_DATA, OLDER_BOOT_DATA, UNEXPECTED_RESET, PROGRAM_TAKEN_BACK];

const LISTS: &[&[Fault]] = &[OWN, &profiles::FAULTS];

/// All faults, in the order of their numbers ([`canopen::Fault::Application`]).
pub static FAULTS: [Fault; count(LISTS)] = gather(LISTS);

/// The faults as the device treats them, in the same order. Object 1029h:2 applies to every fault with a flag.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
pub(crate) const CONDITIONS: [Condition; count(LISTS)] = {
    let faults: [Fault; count(LISTS)] = gather(LISTS);
    let mut conditions = [Condition::new(0); count(LISTS)];
    let mut i = 0;
    while i < conditions.len() {
        let Fault { condition, flags, .. } = faults[i];
        let has_flag = flags.sensor | flags.system != 0;
        conditions[i] = if has_flag { condition.of_class(ErrorClass::DEVICE) } else { condition };
        i += 1;
    }
    conditions
};

/// The number of a fault.
pub(crate) fn number(fault: &Fault) -> Option<u8> {
    let mut numbered = (0..).zip(&FAULTS);
    numbered.find(|(_, known)| *known == fault).map(|(number, _)| number)
}

/// The flag of a storage group whose values could not be loaded. Without its calibration, the sensor runs with default
/// values that fit no device.
pub(crate) fn flag_of(group: Group) -> Flags {
    match group {
        Group::Communication => Flags::system(4),
        Group::Application => Flags::system(5),
        _ => Flags::sensor(0),
    }
}
