//! Responses of an LSS slave.

use super::request::{BIT_TIMING, INQUIRE, INQUIRE_NODE_ID, NODE_ID, STORE};
use super::{Part, frame_of_word, word};

/// Command specifiers of the responses that differ from those of their requests.
pub(super) const SELECTED: u8 = 0x44;
pub(super) const IDENTIFIED: u8 = 0x4F;
pub(super) const UNCONFIGURED: u8 = 0x50;

/// A response of an LSS slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response {
    /// The slave has been selected (44h).
    Selected,
    /// Configure node-ID (11h): 0, or 1 for a node-ID out of range.
    NodeId(u8),
    /// Configure bit timing parameters (13h): 0, or 1 for a bit rate that the slave does not support.
    BitTiming(u8),
    /// Store configuration (17h): 0, or 1 for not supported, or 2 for a failure of the memory.
    Stored(u8),
    /// The identity of the slave is in the range, or matches the fastscan request (4Fh).
    Identified,
    /// The slave has no node-ID (50h).
    Unconfigured,
    /// A part of the identity of the slave (5Ah to 5Dh).
    Identity(Part, u32),
    /// The node-ID of the slave (5Eh); 255 when it has none.
    NodeIdIs(u8),
}

impl Response {
    /// `None` for a frame that is not a response.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Response> {
        let [command, code, ..] = frame;
        Some(match command {
            NODE_ID => Response::NodeId(code),
            BIT_TIMING => Response::BitTiming(code),
            STORE => Response::Stored(code),
            SELECTED => Response::Selected,
            IDENTIFIED => Response::Identified,
            UNCONFIGURED => Response::Unconfigured,
            INQUIRE..=0x5D => Response::Identity(Part::numbered(command - INQUIRE)?, word(frame)),
            INQUIRE_NODE_ID => Response::NodeIdIs(code),
            _ => return None,
        })
    }

    /// The data of the frame.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let (command, value) = match self {
            Response::Selected => (SELECTED, 0),
            Response::NodeId(code) => (NODE_ID, code as u32),
            Response::BitTiming(code) => (BIT_TIMING, code as u32),
            Response::Stored(code) => (STORE, code as u32),
            Response::Identified => (IDENTIFIED, 0),
            Response::Unconfigured => (UNCONFIGURED, 0),
            Response::Identity(part, value) => (INQUIRE + part.number(), value),
            Response::NodeIdIs(id) => (INQUIRE_NODE_ID, id as u32),
        };
        frame_of_word(command, value)
    }
}
