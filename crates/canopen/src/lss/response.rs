//! Responses of an LSS slave.

use super::{Part, frame_of_word, word};

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
            0x11 => Response::NodeId(code),
            0x13 => Response::BitTiming(code),
            0x17 => Response::Stored(code),
            0x44 => Response::Selected,
            0x4F => Response::Identified,
            0x50 => Response::Unconfigured,
            0x5A..=0x5D => Response::Identity(Part::numbered(command - 0x5A)?, word(frame)),
            0x5E => Response::NodeIdIs(code),
            _ => return None,
        })
    }

    /// The data of the frame.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let (command, value) = match self {
            Response::Selected => (0x44, 0),
            Response::NodeId(code) => (0x11, code as u32),
            Response::BitTiming(code) => (0x13, code as u32),
            Response::Stored(code) => (0x17, code as u32),
            Response::Identified => (0x4F, 0),
            Response::Unconfigured => (0x50, 0),
            Response::Identity(part, value) => (0x5A + part.number(), value),
            Response::NodeIdIs(id) => (0x5E, id as u32),
        };
        frame_of_word(command, value)
    }
}
