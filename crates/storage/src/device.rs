//! The value of the group [`DeviceRecord::NUMBER`]: what a node must know before it can go on the bus.

use crate::group::GroupNumber;

/// Node-ID, bit rate and personality. A value of this type is always valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceRecord {
    node_id: u8,
    bit_rate_kbit: u16,
    personality: u8,
}

impl DeviceRecord {
    /// The group that holds the record.
    pub const NUMBER: GroupNumber = GroupNumber::One;
    /// Layout version under which the record is stored.
    pub const VERSION: u16 = 1;
    /// Length of the stored record in bytes.
    pub const LEN: usize = 4;
    /// Largest size of the value in bytes: other facts of the device may follow the record.
    pub const ROOM: usize = 144;
    /// The node-ID of a device that has none yet (CiA 305: LSS must assign one).
    pub const UNCONFIGURED: u8 = 255;
    /// The bit rate that asks for automatic detection.
    pub const AUTO: u16 = 0;
    /// The bit rates of CiA 301 in kbit/s.
    pub const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

    /// A record of a node-ID (1..=127, or 255 for unconfigured), a bit rate in kbit/s (one of [`Self::BIT_RATES`], or 0
    /// for automatic detection), and the number of a personality, whose meaning is defined by the dictionary. `None` if
    /// node-ID or bit rate is out of range.
    #[must_use]
    pub fn new(node_id: u8, bit_rate_kbit: u16, personality: u8) -> Option<DeviceRecord> {
        let node_id_fits = matches!(node_id, 1..=127 | Self::UNCONFIGURED);
        let bit_rate_fits = bit_rate_kbit == Self::AUTO || Self::BIT_RATES.contains(&bit_rate_kbit);
        (node_id_fits && bit_rate_fits).then_some(DeviceRecord { node_id, bit_rate_kbit, personality })
    }

    /// The node-ID, 1..=127, or 255 if unconfigured.
    #[must_use]
    pub fn node_id(&self) -> u8 {
        self.node_id
    }

    /// The bit rate in kbit/s, 0 for automatic detection.
    #[must_use]
    pub fn bit_rate_kbit(&self) -> u16 {
        self.bit_rate_kbit
    }

    /// The number of the personality.
    #[must_use]
    pub fn personality(&self) -> u8 {
        self.personality
    }

    /// The stored form: node-ID, personality, bit rate with the low byte first.
    #[must_use]
    pub fn encode(&self) -> [u8; Self::LEN] {
        let [low, high] = self.bit_rate_kbit.to_le_bytes();
        [self.node_id, self.personality, low, high]
    }

    /// The record at the start of `bytes` in layout `version`; `None` for another version, too few bytes or a value out
    /// of range.
    #[must_use]
    pub fn decode(version: u16, bytes: &[u8]) -> Option<DeviceRecord> {
        let (Self::VERSION, &[node_id, personality, low, high, ..]) = (version, bytes) else {
            return None;
        };
        DeviceRecord::new(node_id, u16::from_le_bytes([low, high]), personality)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_reads_back() {
        let record = DeviceRecord::new(5, 250, 3).unwrap();
        assert_eq!((record.node_id(), record.bit_rate_kbit(), record.personality()), (5, 250, 3));
        assert_eq!(record.encode(), [5, 3, 250, 0]);
    }

    #[test]
    fn every_record_that_can_be_made_decodes_to_itself() {
        for node_id in 0..=255 {
            for rate in 0..=1100 {
                let Some(record) = DeviceRecord::new(node_id, rate, 3) else { continue };
                assert_eq!(DeviceRecord::decode(DeviceRecord::VERSION, &record.encode()), Some(record));
            }
        }
    }

    #[test]
    fn the_valid_ranges_are_those_of_cia_301_and_305() {
        let ids: std::vec::Vec<u8> = (0..=255).filter(|&id| DeviceRecord::new(id, 0, 0).is_some()).collect();
        assert_eq!(ids, (1..=127).chain([255]).collect::<std::vec::Vec<u8>>());
        let rates: std::vec::Vec<u16> =
            (0..=u16::MAX).filter(|&r| DeviceRecord::new(1, r, 0).is_some()).collect();
        assert_eq!(rates, [0, 10, 20, 50, 125, 250, 500, 800, 1000]);
    }

    #[test]
    fn whatever_decodes_is_valid_and_anything_else_is_refused() {
        let good = DeviceRecord::new(5, 250, 1).unwrap().encode();
        assert!(DeviceRecord::decode(DeviceRecord::VERSION + 1, &good).is_none());
        assert!(DeviceRecord::decode(DeviceRecord::VERSION, &good[..3]).is_none());
        assert!(DeviceRecord::decode(DeviceRecord::VERSION, &[0, 1, 250, 0]).is_none());
        assert!(DeviceRecord::decode(DeviceRecord::VERSION, &[5, 1, 251, 0]).is_none());
    }
}
