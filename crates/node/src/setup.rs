//! What a node must know before it starts.

use crate::Personality;
use canopen::NodeId;
use canopen::lss::BitRate;

/// Vendor-ID of object 1018h:1. 0 is no vendor: put the one CiA assigned to you here.
pub const VENDOR_ID: u32 = 0;
/// Revision number of object 1018h:3: major in the high word, minor in the low word.
pub const REVISION: u32 = 0x0001_0000;

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
