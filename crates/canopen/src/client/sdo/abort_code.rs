//! SDO abort codes and their meaning as text.

use core::fmt;

use crate::sdo::Abort;

/// Why a server refused or gave up a transfer (CiA 301, 7.2.4.3.17). Codes of other standards and of vendors are valid
/// too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AbortCode(pub u32);

/// Abort codes and their meaning (CiA 301, 7.2.4.3.17).
#[rustfmt::skip]
const MEANINGS: [(u32, &str); 31] = [
    (0x0503_0000, "toggle bit not alternated"),
    (0x0504_0000, "SDO protocol timed out"),
    (0x0504_0001, "command specifier not valid or unknown"),
    (0x0504_0002, "invalid block size"),
    (0x0504_0003, "invalid sequence number"),
    (0x0504_0004, "CRC error"),
    (0x0504_0005, "out of memory"),
    (0x0601_0000, "access to this object is not supported"),
    (0x0601_0001, "attempt to read a write-only object"),
    (0x0601_0002, "attempt to write a read-only object"),
    (0x0602_0000, "object does not exist"),
    (0x0604_0041, "object cannot be mapped into the PDO"),
    (0x0604_0042, "mapped objects would exceed the PDO length"),
    (0x0604_0043, "incompatible with another parameter"),
    (0x0604_0047, "internal incompatibility in the device"),
    (0x0606_0000, "access failed because of a hardware error"),
    (0x0607_0010, "length does not match the data type"),
    (0x0607_0012, "too long for the data type"),
    (0x0607_0013, "too short for the data type"),
    (0x0609_0011, "sub-index does not exist"),
    (0x0609_0030, "invalid value for the parameter"),
    (0x0609_0031, "value too high"),
    (0x0609_0032, "value too low"),
    (0x0609_0036, "maximum is less than minimum"),
    (0x060A_0023, "resource (SDO connection) not available"),
    (0x0800_0000, "general error"),
    (0x0800_0020, "data cannot be transferred or stored"),
    (0x0800_0021, "data cannot be transferred or stored because of local control"),
    (0x0800_0022, "data cannot be transferred or stored in the present device state"),
    (0x0800_0023, "no object dictionary present"),
    (0x0800_0024, "no data available"),
];

impl AbortCode {
    /// Meaning of the code; `None` where CiA 301 defines none.
    #[must_use]
    pub fn meaning(self) -> Option<&'static str> {
        MEANINGS.iter().find(|row| row.0 == self.0).map(|row| row.1)
    }

    /// Whether there is no such object or sub-index.
    #[must_use]
    pub fn is_absent(self) -> bool {
        self == Abort::NoObject.into() || self == Abort::NoSubIndex.into()
    }

    /// Whether the server refused the protocol and not the value: another kind of transfer may succeed.
    #[must_use]
    pub fn is_protocol(self) -> bool {
        matches!(self.0 >> 16, 0x0503 | 0x0504) && !self.is_time_out()
    }

    /// Whether the server has waited too long for the client: frames were lost.
    #[must_use]
    pub fn is_time_out(self) -> bool {
        self == Abort::TimeOut.into()
    }
}

impl From<Abort> for AbortCode {
    fn from(abort: Abort) -> AbortCode {
        AbortCode(abort.code())
    }
}

/// For example `0609 0030h, invalid value for the parameter`.
impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let meaning = self.meaning().unwrap_or("a code that CiA 301 does not define");
        write!(f, "{:04X} {:04X}h, {meaning}", self.0 >> 16, self.0 & 0xFFFF)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted_without_doubles() {
        assert!(MEANINGS.is_sorted_by(|a, b| a.0 < b.0));
    }
}
