//! SDO abort codes (CiA 301, 7.2.4.3.17).

/// Why a transfer was refused or aborted. One byte in memory; `code` gives the 32 bits of the abort message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Abort {
    /// The toggle bit did not alternate.
    Toggle,
    /// The other side did not answer in time.
    TimeOut,
    /// The command specifier is unknown, or not valid in this state.
    Command,
    /// The block size is not 1 to 127.
    BlockSize,
    /// The sequence number is impossible.
    Sequence,
    /// The CRC does not match.
    Crc,
    /// The memory does not suffice.
    OutOfMemory,
    /// The object does not support the access, or not now.
    Access,
    /// An attempt to read a write-only object.
    WriteOnly,
    /// An attempt to write a read-only object.
    ReadOnly,
    /// The object does not exist.
    NoObject,
    /// The object cannot be mapped into the PDO.
    NotMappable,
    /// The mapped objects are longer than a PDO.
    PdoLength,
    /// The value contradicts the value of another parameter.
    Parameter,
    /// The device cannot carry out the request for an internal reason.
    Incompatible,
    /// The hardware has failed.
    Hardware,
    /// The length of the data does not match the type.
    Length,
    /// The data is longer than the type.
    TooLong,
    /// The data is shorter than the type.
    TooShort,
    /// The sub-index does not exist.
    NoSubIndex,
    /// The value is not allowed.
    InvalidValue,
    /// The value is above the upper limit.
    ValueTooHigh,
    /// The value is below the lower limit.
    ValueTooLow,
    /// The maximum is below the minimum.
    LimitsReversed,
    /// An SDO connection is not available.
    NoConnection,
    /// An error without a code of its own.
    General,
    /// The data cannot be stored.
    NotStored,
    /// The data cannot be stored because the device is under local control.
    LocalControl,
    /// The data cannot be stored in the present state of the device.
    DeviceState,
    /// There is no object dictionary.
    NoDictionary,
    /// There is no data.
    NoData,
}

impl Abort {
    /// All reasons, in the order of their codes.
    pub const ALL: [Abort; 31] = [
        Abort::Toggle,
        Abort::TimeOut,
        Abort::Command,
        Abort::BlockSize,
        Abort::Sequence,
        Abort::Crc,
        Abort::OutOfMemory,
        Abort::Access,
        Abort::WriteOnly,
        Abort::ReadOnly,
        Abort::NoObject,
        Abort::NotMappable,
        Abort::PdoLength,
        Abort::Parameter,
        Abort::Incompatible,
        Abort::Hardware,
        Abort::Length,
        Abort::TooLong,
        Abort::TooShort,
        Abort::NoSubIndex,
        Abort::InvalidValue,
        Abort::ValueTooHigh,
        Abort::ValueTooLow,
        Abort::LimitsReversed,
        Abort::NoConnection,
        Abort::General,
        Abort::NotStored,
        Abort::LocalControl,
        Abort::DeviceState,
        Abort::NoDictionary,
        Abort::NoData,
    ];

    /// The code on the wire.
    #[must_use]
    #[allow(clippy::indexing_slicing, reason = "the table has all reasons")]
    pub const fn code(self) -> u32 {
        let digits = DIGITS[self as usize] as u32;
        (digits & 0xF000) << 12 | (digits & 0x0F00) << 8 | digits & 0xFF
    }

    /// The code without the zeros that all codes have: 6A23h for 060A 0023h.
    const fn digits(self) -> u16 {
        match self {
            Abort::Toggle => 0x5300,
            Abort::TimeOut => 0x5400,
            Abort::Command => 0x5401,
            Abort::BlockSize => 0x5402,
            Abort::Sequence => 0x5403,
            Abort::Crc => 0x5404,
            Abort::OutOfMemory => 0x5405,
            Abort::Access => 0x6100,
            Abort::WriteOnly => 0x6101,
            Abort::ReadOnly => 0x6102,
            Abort::NoObject => 0x6200,
            Abort::NotMappable => 0x6441,
            Abort::PdoLength => 0x6442,
            Abort::Parameter => 0x6443,
            Abort::Incompatible => 0x6447,
            Abort::Hardware => 0x6600,
            Abort::Length => 0x6710,
            Abort::TooLong => 0x6712,
            Abort::TooShort => 0x6713,
            Abort::NoSubIndex => 0x6911,
            Abort::InvalidValue => 0x6930,
            Abort::ValueTooHigh => 0x6931,
            Abort::ValueTooLow => 0x6932,
            Abort::LimitsReversed => 0x6936,
            Abort::NoConnection => 0x6A23,
            Abort::General => 0x8000,
            Abort::NotStored => 0x8020,
            Abort::LocalControl => 0x8021,
            Abort::DeviceState => 0x8022,
            Abort::NoDictionary => 0x8023,
            Abort::NoData => 0x8024,
        }
    }

    /// Meaning of the code (CiA 301, table 22).
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Abort::Toggle => "toggle bit not alternated",
            Abort::TimeOut => "SDO protocol timed out",
            Abort::Command => "command specifier not valid or unknown",
            Abort::BlockSize => "invalid block size",
            Abort::Sequence => "invalid sequence number",
            Abort::Crc => "CRC error",
            Abort::OutOfMemory => "out of memory",
            Abort::Access => "unsupported access to an object",
            Abort::WriteOnly => "attempt to read a write-only object",
            Abort::ReadOnly => "attempt to write a read-only object",
            Abort::NoObject => "object does not exist in the object dictionary",
            Abort::NotMappable => "object cannot be mapped to the PDO",
            Abort::PdoLength => "mapped objects exceed the length of the PDO",
            Abort::Parameter => "general parameter incompatibility",
            Abort::Incompatible => "general internal incompatibility in the device",
            Abort::Hardware => "access failed due to a hardware error",
            Abort::Length => "data type or length does not match",
            Abort::TooLong => "data type does not match, length too high",
            Abort::TooShort => "data type does not match, length too low",
            Abort::NoSubIndex => "sub-index does not exist",
            Abort::InvalidValue => "invalid value for parameter",
            Abort::ValueTooHigh => "value of parameter written too high",
            Abort::ValueTooLow => "value of parameter written too low",
            Abort::LimitsReversed => "maximum value is less than minimum value",
            Abort::NoConnection => "resource not available: SDO connection",
            Abort::General => "general error",
            Abort::NotStored => "data cannot be transferred or stored to the application",
            Abort::LocalControl => "data cannot be transferred or stored because of local control",
            Abort::DeviceState => "data cannot be transferred or stored because of the present device state",
            Abort::NoDictionary => "no object dictionary present",
            Abort::NoData => "no data available",
        }
    }
}

/// The digits of all codes, which take half of the flash that the codes would take.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
const DIGITS: [u16; Abort::ALL.len()] = {
    let (mut digits, mut i) = ([0; Abort::ALL.len()], 0);
    while i < digits.len() {
        digits[Abort::ALL[i] as usize] = Abort::ALL[i].digits();
        i += 1;
    }
    digits
};

/// The meaning and the code.
impl core::fmt::Display for Abort {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} ({:08X}h)", self.meaning(), self.code())
    }
}

impl core::error::Error for Abort {}
