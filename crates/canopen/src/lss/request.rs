//! Requests of the LSS master.

use super::{Part, frame_of_word, word};

/// A request of the LSS master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Switch state global (04h): switches all slaves to the configuration state or the waiting state.
    SwitchGlobal {
        /// `true` for the configuration state.
        configuration: bool,
    },
    /// Switch state selective (40h to 43h): one of four messages that together address one slave.
    Select(Part, u32),
    /// Configure node-ID (11h); 255 for no node-ID.
    NodeId(u8),
    /// Configure bit timing parameters (13h): a table and an index in the table.
    BitTiming {
        /// Table selector; 0 is the table of CiA 301.
        table: u8,
        /// Index in the table.
        index: u8,
    },
    /// Activate bit timing parameters (15h), with the switch delay in ms.
    Activate {
        /// Switch delay in ms: the time without transmission before the switch, and again after it.
        delay: u16,
    },
    /// Store configuration (17h).
    Store,
    /// Identify remote slave (46h to 4Bh): one of six messages that together define a range of identities.
    Identify(Bound, u32),
    /// Identify non-configured remote slave (4Ch).
    IdentifyUnconfigured,
    /// Fastscan (51h).
    Fastscan {
        /// The value to compare with.
        value: u32,
        /// The lowest bit to compare, 0 to 31, or [`Request::CONFIRM`].
        bit: u8,
        /// The part of the identity to compare, 0 to 3.
        part: u8,
        /// The part to compare next, 0 to 3.
        next: u8,
    },
    /// Inquire identity (5Ah to 5Dh).
    Inquire(Part),
    /// Inquire node-ID (5Eh).
    InquireNodeId,
}

/// A bound of the range of identities in an identify request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The vendor-ID.
    Vendor,
    /// The product code.
    Product,
    /// The lowest revision number.
    RevisionLow,
    /// The highest revision number.
    RevisionHigh,
    /// The lowest serial number.
    SerialLow,
    /// The highest serial number.
    SerialHigh,
}

impl Bound {
    /// All bounds, in the order in which they are sent.
    pub const ALL: [Bound; 6] = [
        Bound::Vendor,
        Bound::Product,
        Bound::RevisionLow,
        Bound::RevisionHigh,
        Bound::SerialLow,
        Bound::SerialHigh,
    ];
}

/// Command specifiers. The messages of a series follow each other.
pub(super) const SWITCH_GLOBAL: u8 = 0x04;
pub(super) const NODE_ID: u8 = 0x11;
pub(super) const BIT_TIMING: u8 = 0x13;
pub(super) const ACTIVATE: u8 = 0x15;
pub(super) const STORE: u8 = 0x17;
pub(super) const SELECT: u8 = 0x40;
pub(super) const IDENTIFY: u8 = 0x46;
pub(super) const IDENTIFY_UNCONFIGURED: u8 = 0x4C;
pub(super) const FASTSCAN: u8 = 0x51;
pub(super) const INQUIRE: u8 = 0x5A;
pub(super) const INQUIRE_NODE_ID: u8 = 0x5E;

impl Request {
    /// Value of `bit` in a fastscan request that asks whether there is any unconfigured slave.
    pub const CONFIRM: u8 = 0x80;

    /// `None` for a frame that is not a request.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Request> {
        let [command, first, second, ..] = frame;
        let value = word(frame);
        Some(match command {
            SWITCH_GLOBAL if first <= 1 => Request::SwitchGlobal { configuration: first == 1 },
            NODE_ID => Request::NodeId(first),
            BIT_TIMING => Request::BitTiming { table: first, index: second },
            ACTIVATE => Request::Activate { delay: u16::from_le_bytes([first, second]) },
            STORE => Request::Store,
            SELECT..=0x43 => Request::Select(Part::numbered(command - SELECT)?, value),
            IDENTIFY..=0x4B => Request::Identify(*Bound::ALL.get(usize::from(command - IDENTIFY))?, value),
            IDENTIFY_UNCONFIGURED => Request::IdentifyUnconfigured,
            FASTSCAN => fastscan(frame)?,
            INQUIRE..=0x5D => Request::Inquire(Part::numbered(command - INQUIRE)?),
            INQUIRE_NODE_ID => Request::InquireNodeId,
            _ => return None,
        })
    }

    /// The data of the frame.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        match self {
            Request::SwitchGlobal { configuration } => [SWITCH_GLOBAL, configuration as u8, 0, 0, 0, 0, 0, 0],
            Request::Select(part, value) => frame_of_word(SELECT + part.number(), value),
            Request::NodeId(id) => [NODE_ID, id, 0, 0, 0, 0, 0, 0],
            Request::BitTiming { table, index } => [BIT_TIMING, table, index, 0, 0, 0, 0, 0],
            Request::Activate { delay } => frame_of_word(ACTIVATE, delay as u32),
            Request::Store => [STORE, 0, 0, 0, 0, 0, 0, 0],
            Request::Identify(bound, value) => frame_of_word(IDENTIFY + bound as u8, value),
            Request::IdentifyUnconfigured => [IDENTIFY_UNCONFIGURED, 0, 0, 0, 0, 0, 0, 0],
            Request::Fastscan { value, bit, part, next } => {
                let [a, b, c, d] = value.to_le_bytes();
                [FASTSCAN, a, b, c, d, bit, part, next]
            }
            Request::Inquire(part) => [INQUIRE + part.number(), 0, 0, 0, 0, 0, 0, 0],
            Request::InquireNodeId => [INQUIRE_NODE_ID, 0, 0, 0, 0, 0, 0, 0],
        }
    }
}

fn fastscan(frame: [u8; 8]) -> Option<Request> {
    let [.., bit, part, next] = frame;
    let is_valid = (bit <= 31 || bit == Request::CONFIRM) && part <= 3 && next <= 3;
    is_valid.then_some(Request::Fastscan { value: word(frame), bit, part, next })
}
