//! The node-ID, and the CAN-IDs that depend on it.

use crate::CanId;
use core::num::NonZeroU8;

/// A node-ID, 1 to 127 (CiA 301, 7.3.5). 0 addresses all nodes and is not a node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NodeId(NonZeroU8);

impl NodeId {
    /// `None` for a number outside 1 to 127.
    #[must_use]
    pub const fn new(id: u8) -> Option<NodeId> {
        match NonZeroU8::new(id) {
            Some(id) if id.get() <= 127 => Some(NodeId(id)),
            _ => None,
        }
    }

    /// The node-ID as a number, 1 to 127.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0.get()
    }

    /// The CAN-ID of a service of this node in the pre-defined connection set (CiA 301, 7.3.5).
    pub(crate) const fn service(self, function: u16) -> CanId {
        CanId::of_service(function, self.get())
    }
}
