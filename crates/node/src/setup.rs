//! The values that a node needs before its start.

use canopen::NodeId;
use canopen::lss::BitRate;
use profiles::Personality;

/// Everything that comes from outside the dictionary: the configuration of the board and of the image.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The personality.
    pub personality: Personality,
    /// The node-ID; `None` for a node that needs one from LSS.
    pub node_id: Option<NodeId>,
    /// The configured bit rate, which may be automatic detection.
    pub bit_rate: BitRate,
    /// Serial number, object 1018h:4.
    pub serial_number: u32,
    /// Object 1F56h:1, identification of the program: the CRC-32 of its image.
    pub program_id: u32,
    /// Object 1009h: at most 32 ASCII characters; further ones are cut off.
    pub hardware_version: &'static str,
    /// Object 100Ah: at most 50 ASCII characters; further ones are cut off.
    pub software_version: &'static str,
}
