//! The objects of the SDO channels.

use super::{fixed, parameter};
use crate::dictionary::{DefaultValue, Object, Type};

/// A COB-ID that is not used: bit 31 is set.
const OFF: i64 = 0x8000_0000;

/// 1200h, the default SDO server: read-only, as its CAN-IDs follow the node-ID. Optional.
#[must_use]
pub const fn default_sdo_server() -> [Object; 3] {
    [
        Object::highest(0x1200, 2, "SDO server parameter"),
        fixed(0x1200, 1, "COB-ID client to server", Type::Unsigned32).default(DefaultValue::NodeId(0x600)),
        fixed(0x1200, 2, "COB-ID server to client", Type::Unsigned32).default(DefaultValue::NodeId(0x580)),
    ]
}

/// 1200h + `number` - 1, a further SDO server, from number 2 on without a gap: two clients can have a transfer under way at
/// the same time. A master writes the COB-IDs; both are disabled by default.
///
/// # Panics
/// During compilation, for a number outside 2 to 128.
#[must_use]
pub const fn sdo_server(number: u16) -> [Object; 4] {
    assert!(number >= 2 && number <= 128, "a further SDO server has a number of 2 to 128");
    channel(0x11FF + number, ["SDO server parameter", "Node-ID of the client"])
}

/// 127Fh + `number`, an SDO client: the application reads and writes objects of other nodes by the channel that a master
/// has written here ([`Device::sdo_client`](crate::Device::sdo_client)). Both COB-IDs are disabled by default.
///
/// # Panics
/// During compilation, for a number outside 1 to 128.
#[must_use]
pub const fn sdo_client(number: u16) -> [Object; 4] {
    assert!(number >= 1 && number <= 128, "an SDO client has a number of 1 to 128");
    channel(0x127F + number, ["SDO client parameter", "Node-ID of the server"])
}

const fn channel(index: u16, [name, node]: [&'static str; 2]) -> [Object; 4] {
    [
        Object::highest(index, 3, name),
        parameter(index, 1, "COB-ID client to server", Type::Unsigned32).value(OFF),
        parameter(index, 2, "COB-ID server to client", Type::Unsigned32).value(OFF),
        parameter(index, 3, node, Type::Unsigned8),
    ]
}
