//! SDO abort codes (CiA 301, 7.2.4.3.17).

/// Why a transfer was refused or given up. The discriminant is the code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Abort {
    /// The toggle bit did not alternate.
    Toggle = 0x0503_0000,
    /// The other side was silent for too long.
    TimeOut = 0x0504_0000,
    /// The command specifier is unknown or not valid now.
    Command = 0x0504_0001,
    /// The block size is not 1 to 127.
    BlockSize = 0x0504_0002,
    /// A sequence number that cannot be.
    Sequence = 0x0504_0003,
    /// The CRC does not match.
    Crc = 0x0504_0004,
    /// The access is not possible on this object, or not now.
    Access = 0x0601_0000,
    /// An attempt to read a write-only object.
    WriteOnly = 0x0601_0001,
    /// An attempt to write a read-only object.
    ReadOnly = 0x0601_0002,
    /// The object does not exist.
    NoObject = 0x0602_0000,
    /// The object cannot be mapped into the PDO.
    NotMappable = 0x0604_0041,
    /// The mapped objects are longer than a PDO.
    PdoLength = 0x0604_0042,
    /// The value contradicts that of another parameter.
    Parameter = 0x0604_0043,
    /// The hardware has failed.
    Hardware = 0x0606_0000,
    /// The length of the data does not match the type.
    Length = 0x0607_0010,
    /// The data is longer than the type.
    TooLong = 0x0607_0012,
    /// The data is shorter than the type.
    TooShort = 0x0607_0013,
    /// The sub-index does not exist.
    NoSubIndex = 0x0609_0011,
    /// The value is not allowed.
    InvalidValue = 0x0609_0030,
    /// The value is above the upper limit.
    ValueTooHigh = 0x0609_0031,
    /// The value is below the lower limit.
    ValueTooLow = 0x0609_0032,
    /// Something that has no code of its own.
    General = 0x0800_0000,
    /// The data cannot be stored.
    NotStored = 0x0800_0020,
    /// The data cannot be stored in the present state of the device.
    DeviceState = 0x0800_0022,
    /// There is no data.
    NoData = 0x0800_0024,
}

impl Abort {
    /// The code on the wire.
    #[must_use]
    pub const fn code(self) -> u32 {
        self as u32
    }
}
