//! Multiplexed PDOs (CiA 301, 7.2.2.6): a PDO that says itself which object it carries, in at most four bytes.

use crate::NodeId;
use crate::sdo::Multiplexer;

/// How a multiplexed PDO addresses, as the number of mapped objects (1600h.., 1A00h..:0) says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addressing {
    /// 254, source address mode: the object is one of the sender's.
    Source,
    /// 255, destination address mode: the object is one of the receiver's.
    Destination,
}

impl Addressing {
    /// `None` for an ordinary number of mapped objects.
    #[must_use]
    pub const fn from_count(count: u8) -> Option<Addressing> {
        match count {
            0xFE => Some(Addressing::Source),
            0xFF => Some(Addressing::Destination),
            _ => None,
        }
    }
}

/// The node whose object a multiplexed PDO carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// An object of this node, which has sent the PDO.
    Source(NodeId),
    /// An object of this receiver; `None` for all nodes.
    Destination(Option<NodeId>),
}

/// The content of a multiplexed PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mpdo {
    /// The node whose object a multiplexed PDO carries.
    pub address: Address,
    /// The object.
    pub at: Multiplexer,
    /// Its value; what is shorter than four bytes is followed by zeros.
    pub data: [u8; 4],
}

/// Bit 7 of the address: destination address mode.
const DESTINATION: u8 = 0x80;

impl Mpdo {
    /// `None` for a sender that is no node.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Mpdo> {
        let [address, _, _, _, data @ ..] = frame;
        let node = NodeId::new(address & !DESTINATION);
        let address =
            if address & DESTINATION == 0 { Address::Source(node?) } else { Address::Destination(node) };
        Some(Mpdo { address, at: Multiplexer::parse(&frame), data })
    }

    /// The frame's data.
    #[must_use]
    pub fn encode(self) -> [u8; 8] {
        let address = match self.address {
            Address::Source(node) => node.get(),
            Address::Destination(node) => DESTINATION | node.map_or(0, NodeId::get),
        };
        self.at.frame(address, self.data)
    }
}
