//! TPDO 1 sends the position by event and timer, TPDO 2 with every SYNC (CiA 406, 6.4). The other TPDOs are not used by
//! default.

use super::values::POSITION;
use crate::communication::Tpdo;
use canopen::dictionary::DefaultValue;

const POSITION_VALUE: &[i64] = &[POSITION as i64];

/// Type 254: sent on entering Operational and when the event timer (6200h) elapses. A change of the position is no
/// event: CiA 406 names only these two, and a turning shaft changes the position a thousand times a second.
pub(crate) const BY_EVENT: Tpdo = Tpdo {
    number: 0,
    cob_id: DefaultValue::NodeId(0x180),
    transmission: 254,
    event_timer: 0,
    mapped: POSITION_VALUE,
};

pub(crate) const BY_SYNC: Tpdo = Tpdo {
    number: 1,
    cob_id: DefaultValue::NodeId(0x280),
    transmission: 1,
    event_timer: 0,
    mapped: POSITION_VALUE,
};

pub(super) const TPDOS: [Tpdo; 8] = [
    BY_EVENT,
    BY_SYNC,
    Tpdo::spare(2),
    Tpdo::spare(3),
    Tpdo::spare(4),
    Tpdo::spare(5),
    Tpdo::spare(6),
    Tpdo::spare(7),
];
