//! Manufacturer-specific objects that every device of the project has.

use canopen::dictionary::{Access, Group, Object, Type};

/// Index of the object that selects the personality after the next reset.
pub const PERSONALITY: u16 = 0x2000;

/// 2000h, in a node with `count` personalities. Stored at once, together with node-ID and bit rate, without a write to
/// 1010h. Stored parameters belong to the personality that stored them.
#[allow(clippy::cast_possible_wrap)] // There are only a few.
#[must_use]
pub const fn personality(own: u8, count: usize) -> Object {
    Object::new(PERSONALITY, 0, "Personality", Type::Unsigned8, Access::ReadWrite)
        .value(own as i64)
        .limits(0, count as i64 - 1)
        .setting()
}

/// 2F00h: a domain in RAM, for trying out transfers.
pub const TRANSFER_BUFFER: Object =
    Object::new(0x2F00, 0, "Transfer buffer", Type::Domain, Access::ReadWrite);

/// Index of the object about the trial of a new program.
pub const PROGRAM_TRIAL: u16 = 0x2002;

/// Whether the node, and not a profile, decides on a write to this object.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    matches!((index, sub), (PROGRAM_TRIAL, 2) | (PROGRAM_AUTHORISATION, 3))
}

const fn seconds(sub: u8, name: &'static str, default: i64) -> Object {
    Object::new(PROGRAM_TRIAL, sub, name, Type::Unsigned16, Access::ReadWrite)
        .value(default)
        .stored(Group::Application)
}

/// 2002h: state of the trial of a new program, the commands that end the trial, and the times in seconds (0: none).
/// docs/update.md describes how they work together.
pub const PROGRAM_TRIAL_ROWS: &[Object] = &[
    Object::highest(PROGRAM_TRIAL, 4, "Program trial"),
    Object::new(PROGRAM_TRIAL, 1, "State", Type::Unsigned8, Access::ReadOnly),
    Object::new(PROGRAM_TRIAL, 2, "Command", Type::Unsigned32, Access::WriteOnly).handled(),
    seconds(3, "Time to be confirmed", 600),
    seconds(4, "Time of the automatic confirmation", 0),
];

/// Index of the object that controls who may change the program.
pub const PROGRAM_AUTHORISATION: u16 = 0x2003;

/// 2003h: whether the program may be changed, the challenge of this start, and the response. docs/update.md describes
/// how the response is computed.
pub const PROGRAM_AUTHORISATION_ROWS: &[Object] = &[
    Object::highest(PROGRAM_AUTHORISATION, 3, "Program authorisation"),
    Object::new(PROGRAM_AUTHORISATION, 1, "State", Type::Unsigned8, Access::ReadOnly),
    Object::new(PROGRAM_AUTHORISATION, 2, "Challenge", Type::Unsigned64, Access::ReadOnly),
    Object::new(PROGRAM_AUTHORISATION, 3, "Response", Type::Unsigned64, Access::WriteOnly).handled(),
];

/// Index of the object about the programs of the node.
pub const PROGRAM_STATE: u16 = 0x2004;

const fn fact(sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(PROGRAM_STATE, sub, name, kind, Access::ReadOnly)
}

/// 2004h: facts about the board and its programs, for the master of an update. Programs are named by their identification,
/// as in 1F56h; 0 without a program.
pub const PROGRAM_STATE_ROWS: &[Object] = &[
    Object::highest(PROGRAM_STATE, 7, "Program state"),
    fact(1, "Board", Type::Unsigned32).value(crate::product::BOARD as i64),
    fact(2, "Security counter", Type::Unsigned32),
    fact(3, "Key generation", Type::Unsigned8),
    fact(4, "Downloaded program", Type::Unsigned32),
    fact(5, "Kept program", Type::Unsigned32),
    fact(6, "Sector erases", Type::Unsigned16),
    // The budget of `update` after power-on.
    fact(7, "Clears allowed", Type::Unsigned8).value(50),
];

/// Index of the log of updates.
pub const UPDATE_LOG: u16 = 0x2006;

/// 2006h: the last sixteen events of updates. docs/update.md describes an event.
pub const UPDATE_LOG_ROW: Object = Object::new(UPDATE_LOG, 0, "Update log", Type::Domain, Access::ReadOnly);

/// Index of the object that counts lost events.
pub const LOST_EVENTS: u16 = 0x2001;

/// Number of kinds of lost events: sub-indexes 1 to this one.
pub const LOST_EVENT_KINDS: u8 = 10;

const fn count(sub: u8, name: &'static str) -> Object {
    Object::new(LOST_EVENTS, sub, name, Type::Unsigned32, Access::ReadOnly)
}

/// 2001h: events of the hardware that were lost and recovered from, counted since the start. A healthy board shows
/// zeros.
pub const LOST_EVENT_ROWS: &[Object] = &[
    Object::highest(LOST_EVENTS, LOST_EVENT_KINDS, "Lost events"),
    count(1, "Received frames"),
    count(2, "Milliseconds of samples"),
    count(3, "Restarts of the sampling"),
    count(4, "SSI words"),
    count(5, "Restarts of the index capture"),
    count(6, "Timer alarms"),
    count(7, "Writes to the backup memory"),
    count(8, "Flash operations"),
    count(9, "Resets of the CAN controller"),
    count(10, "Flash operations refused by a low supply"),
];

/// Index of the object about the parameter memory.
pub const PARAMETER_MEMORY: u16 = 0x2010;

const fn memory(sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(PARAMETER_MEMORY, sub, name, kind, Access::ReadOnly)
}

/// 2010h: room and wear of the parameter memory. docs/communication.md describes when the node makes room.
pub const PARAMETER_MEMORY_ROWS: &[Object] = &[
    Object::highest(PARAMETER_MEMORY, 3, "Parameter memory"),
    memory(1, "Saves left", Type::Unsigned16),
    memory(2, "Page erases", Type::Unsigned16),
    memory(3, "Page erases allowed", Type::Unsigned8),
];

/// Index of the object that shows values of the board.
pub const SELF_TEST: u16 = 0x2005;

/// The upper three bytes of a value of 2005h that selects a value of the board: "tes".
pub const SELF_TEST_KEY: u32 = u32::from_be_bytes(*b"\0tes");

/// 2005h: the key with a number in the lowest byte; an upload after that has the value of the board with this number.
/// docs/board.md has the numbers.
pub const SELF_TEST_ROW: Object = Object::new(SELF_TEST, 0, "Self-test", Type::Unsigned32, Access::ReadWrite);
