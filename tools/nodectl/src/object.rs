//! The notation of objects.

use std::fmt;

use canopen::sdo::Multiplexer;

/// Index and sub-index as CiA writes them: `1018h:1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place(pub Multiplexer);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(&format!("{:04X}h:{}", self.0.index, self.0.sub))
    }
}

/// Index and sub-index.
#[must_use]
pub const fn at(index: u16, sub: u8) -> Multiplexer {
    Multiplexer { index, sub }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_can_be_aligned() {
        assert_eq!(format!("{:<9}|", Place(at(0x6130, 2))), "6130h:2  |");
        assert_eq!(Place(at(0x1003, 10)).to_string(), "1003h:10");
    }
}
