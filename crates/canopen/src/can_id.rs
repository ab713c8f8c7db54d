//! CAN-IDs, and COB-IDs as the dictionary stores them.

/// An 11-bit CAN-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CanId(u16);

/// The restricted CAN-IDs (CiA 301, 7.3.5), as first and last of each range.
const RESTRICTED: [(u16, u16); 6] =
    [(0x000, 0x07F), (0x101, 0x180), (0x581, 0x5FF), (0x601, 0x67F), (0x6E0, 0x6FF), (0x701, 0x7FF)];

impl CanId {
    /// NMT commands (CiA 301, 7.3.5).
    pub const NMT: CanId = CanId(0x000);

    /// The last CAN-ID of PDOs in the pre-defined connection set (CiA 301, 7.3.5).
    pub const LAST_PDO: CanId = CanId(0x57F);

    /// The function code in an identifier of the pre-defined connection set.
    pub(crate) const FUNCTION: u16 = 0x780;

    /// A CAN-ID from its number; `None` above 7FFh.
    #[must_use]
    pub const fn new(id: u16) -> Option<CanId> {
        if id <= 0x7FF { Some(CanId(id)) } else { None }
    }

    /// The CAN-ID as a number, 0 to 7FFh.
    #[must_use]
    pub const fn get(self) -> u16 {
        self.0
    }

    /// The identifier of a service in the pre-defined connection set: function code in bits 7..10, node-ID in bits
    /// 0..6.
    pub(crate) const fn of_service(function: u16, node: u8) -> CanId {
        CanId((function & 0x780) | (node & 0x7F) as u16)
    }

    /// Whether a CAN-ID has the function code of this one. The node-ID may be any but 0.
    pub(crate) const fn is_of_same_service(self, id: u16) -> bool {
        (id ^ self.0) & Self::FUNCTION == 0 && id & 0x7F != 0
    }

    /// The identifier with the function code of this one for a node-ID; `None` beyond 127.
    pub(crate) fn of_node(self, node: usize) -> Option<CanId> {
        let node = u8::try_from(node).ok().filter(|node| matches!(node, 1..=127))?;
        Some(CanId::of_service(self.0, node))
    }

    /// One of the two identifiers of LSS (CiA 305): 0 for the responses, 1 for the requests.
    pub(crate) const fn of_lss(direction: u16) -> CanId {
        CanId(0x7E4 | (direction & 1))
    }

    /// Whether configurable services must not use this CAN-ID: NMT, SDO, error control, and the ranges that
    /// CiA 301 reserves (7.3.5, restricted CAN-IDs).
    #[must_use]
    #[inline(never)]
    #[allow(clippy::indexing_slicing, reason = "the index is below the length")]
    pub const fn is_restricted(self) -> bool {
        let mut i = 0;
        while i < RESTRICTED.len() {
            let (first, last) = RESTRICTED[i];
            if first <= self.0 && self.0 <= last {
                return true;
            }
            i += 1;
        }
        false
    }
}

/// The value of a COB-ID entry: an 11-bit CAN-ID and two flags. The meaning of the flags depends on the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CobId {
    /// The CAN-ID, bits 0..10.
    pub id: CanId,
    /// Bit 31.
    pub bit31: bool,
    /// Bit 30.
    pub bit30: bool,
}

impl CobId {
    /// `None` for an extended frame (bit 29) or a CAN-ID of more than 11 bits: this node uses base frames only.
    #[must_use]
    #[allow(clippy::cast_possible_truncation)] // 11 bits.
    #[inline(never)]
    pub const fn parse(value: u32) -> Option<CobId> {
        let id = value & 0x3FFF_FFFF;
        if id > 0x7FF {
            return None;
        }
        Some(CobId { id: CanId(id as u16), bit31: value & 1 << 31 != 0, bit30: value & 1 << 30 != 0 })
    }

    /// The CAN-ID of an enabled service of base frames: all bits above the CAN-ID are 0.
    pub(crate) fn enabled(value: u32) -> Option<CanId> {
        u16::try_from(value).ok().and_then(CanId::new)
    }

    /// The value as the dictionary stores it.
    #[must_use]
    pub const fn encode(self) -> u32 {
        self.id.0 as u32 | (self.bit30 as u32) << 30 | (self.bit31 as u32) << 31
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restricted_ranges_end_where_cia_301_says() {
        let free = [0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700];
        let restricted = [0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x7FF];
        assert!(free.iter().all(|&id| !CanId::new(id).unwrap().is_restricted()));
        assert!(restricted.iter().all(|&id| CanId::new(id).unwrap().is_restricted()));
    }

    #[test]
    fn a_cob_id_has_eleven_bits_and_no_extended_frame() {
        assert_eq!(CobId::parse(0x2000_0080), None);
        assert_eq!(CobId::parse(0x0000_0800), None);
        let cob = CobId::parse(0xC000_0181).unwrap();
        assert_eq!((cob.id.get(), cob.bit31, cob.bit30), (0x181, true, true));
        assert_eq!(cob.encode(), 0xC000_0181);
    }
}
