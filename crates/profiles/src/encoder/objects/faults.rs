//! Faults of the position sensors: those of CiA 406, 5.3, no answer from a sensor, and a wrong position.

use canopen::emcy::Condition;

use crate::encoder::Conditions;
use crate::fault::{Fault, Flags};

/// An encoder does not answer, or sends no valid frame: the error code of a broken pressure sensor, with 1 in the
/// detail.
const ENCODER_BREAK: Fault = Fault {
    name: "EncoderBreak",
    condition: Condition { detail: [1, 0, 0, 0, 0], ..Condition::new(0x5006) },
    flags: Flags::sensor(8),
};
/// An encoder answers, but its position is wrong: 2 in the detail.
const ENCODER_POSITION: Fault = Fault {
    name: "EncoderPosition",
    condition: Condition { detail: [2, 0, 0, 0, 0], ..Condition::new(0x5006) },
    flags: Flags::sensor(11),
};
/// The encoders take too much current; bit 1 of the error register.
const INPUT_CURRENT: Fault = Fault {
    name: "InputCurrent",
    condition: Condition { register: 1 << 1, ..Condition::new(0x2110) },
    flags: Flags::sensor(9),
};
/// The supply of the encoders is out of its limits; bit 2 of the error register.
const INPUT_VOLTAGE: Fault = Fault {
    name: "InputVoltage",
    condition: Condition { register: 1 << 2, ..Condition::new(0x3110) },
    flags: Flags::sensor(10),
};

/// The retained state is damaged, or a memory test has failed.
const HARDWARE_MEMORY: Fault =
    Fault { name: "HardwareMemory", condition: Condition::new(0x5100), flags: Flags::system(8) };

/// All faults of the encoder.
pub const FAULTS: &[Fault] =
    &[ENCODER_BREAK, ENCODER_POSITION, INPUT_CURRENT, INPUT_VOLTAGE, HARDWARE_MEMORY];

impl Conditions {
    /// Calls `each` with every fault and whether the fault is present.
    pub(crate) fn faults(self, each: &mut impl FnMut(&'static Fault, bool)) {
        each(&ENCODER_BREAK, self.sensor_break);
        each(&ENCODER_POSITION, self.position);
        each(&INPUT_CURRENT, self.current);
        each(&INPUT_VOLTAGE, self.voltage);
        each(&HARDWARE_MEMORY, self.memory);
    }
}
