//! Multiplexed PDOs (CiA 301, 7.2.2.6): each frame names the object that it carries, of at most four bytes.

use crate::NodeId;
use crate::sdo::Multiplexer;

/// The node whose object a frame names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// An object of the sender, with the node-ID of the sender.
    Source(NodeId),
    /// An object of the receiver with this node-ID; `None` for all nodes.
    Destination(Option<NodeId>),
}

/// The content of a multiplexed PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mpdo {
    /// The node whose object the frame names.
    pub address: Address,
    /// The object.
    pub at: Multiplexer,
    /// The value of the object; zeros follow a value of less than four bytes.
    pub data: [u8; 4],
}

/// Bit 7 of the address: destination address mode.
const DESTINATION: u8 = 0x80;

impl Mpdo {
    /// `None` for a source address that is not a node-ID.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Mpdo> {
        let [address, _, _, _, data @ ..] = frame;
        let node = NodeId::new(address & !DESTINATION);
        let address =
            if address & DESTINATION == 0 { Address::Source(node?) } else { Address::Destination(node) };
        Some(Mpdo { address, at: Multiplexer::parse(&frame), data })
    }

    /// The data of the frame.
    #[must_use]
    pub fn encode(self) -> [u8; 8] {
        let address = match self.address {
            Address::Source(node) => node.get(),
            Address::Destination(node) => DESTINATION | node.map_or(0, NodeId::get),
        };
        self.at.frame(address, self.data)
    }
}
