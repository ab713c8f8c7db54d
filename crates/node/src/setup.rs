//! The values that a node needs before it starts.

use canopen::NodeId;
use canopen::lss::BitRate;
use profiles::Personality;

/// Everything that comes from outside the dictionary: configuration of the board and of the image.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The device to be.
    pub personality: Personality,
    /// Own node-ID; `None` for a node that LSS must give one.
    pub node_id: Option<NodeId>,
    /// Bit rate as configured, which may be to detect it.
    pub bit_rate: BitRate,
    /// Serial number, object 1018h:4.
    pub serial_number: u32,
    /// Object 1F56h:1, identification of the program: the CRC-32 of its image.
    pub program_id: u32,
    /// Object 1009h: at most 32 ASCII characters, the rest is cut off.
    pub hardware_version: &'static str,
    /// Object 100Ah: at most 50 ASCII characters, the rest is cut off.
    pub software_version: &'static str,
}
