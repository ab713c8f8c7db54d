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
    pub const fn code(self) -> u32 {
        match self {
            Abort::Toggle => 0x0503_0000,
            Abort::TimeOut => 0x0504_0000,
            Abort::Command => 0x0504_0001,
            Abort::BlockSize => 0x0504_0002,
            Abort::Sequence => 0x0504_0003,
            Abort::Crc => 0x0504_0004,
            Abort::OutOfMemory => 0x0504_0005,
            Abort::Access => 0x0601_0000,
            Abort::WriteOnly => 0x0601_0001,
            Abort::ReadOnly => 0x0601_0002,
            Abort::NoObject => 0x0602_0000,
            Abort::NotMappable => 0x0604_0041,
            Abort::PdoLength => 0x0604_0042,
            Abort::Parameter => 0x0604_0043,
            Abort::Incompatible => 0x0604_0047,
            Abort::Hardware => 0x0606_0000,
            Abort::Length => 0x0607_0010,
            Abort::TooLong => 0x0607_0012,
            Abort::TooShort => 0x0607_0013,
            Abort::NoSubIndex => 0x0609_0011,
            Abort::InvalidValue => 0x0609_0030,
            Abort::ValueTooHigh => 0x0609_0031,
            Abort::ValueTooLow => 0x0609_0032,
            Abort::LimitsReversed => 0x0609_0036,
            Abort::NoConnection => 0x060A_0023,
            Abort::General => 0x0800_0000,
            Abort::NotStored => 0x0800_0020,
            Abort::LocalControl => 0x0800_0021,
            Abort::DeviceState => 0x0800_0022,
            Abort::NoDictionary => 0x0800_0023,
            Abort::NoData => 0x0800_0024,
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

/// The meaning and the code.
impl core::fmt::Display for Abort {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} ({:08X}h)", self.meaning(), self.code())
    }
}

impl core::error::Error for Abort {}
