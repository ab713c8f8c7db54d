//! Each device sends its values twice, as encoders do: by event, and with every SYNC. A master uses the PDOs that it
//! needs. The COB-IDs are the four TPDOs of the pre-defined connection set (CiA 301, 7.3.5).

use crate::communication::Tpdo;
use crate::encoder::objects::{BY_EVENT, BY_SYNC};
use canopen::dictionary::DefaultValue;

/// Pressure and temperature.
const PROCESS_VALUES: &[i64] = &[0x6930_0120, 0x6930_0220];

/// The pressure TPDO, set like TPDO 1 of a stand-alone transmitter.
const PRESSURE_BY_EVENT: Tpdo = Tpdo {
    number: 2,
    cob_id: DefaultValue::NodeId(0x380),
    transmission: 255,
    event_timer: 1000,
    mapped: PROCESS_VALUES,
};

const PRESSURE_BY_SYNC: Tpdo = Tpdo {
    number: 3,
    cob_id: DefaultValue::NodeId(0x480),
    transmission: 1,
    event_timer: 0,
    mapped: PROCESS_VALUES,
};

pub(super) const TPDOS: [Tpdo; 8] = [
    BY_EVENT,
    BY_SYNC,
    PRESSURE_BY_EVENT,
    PRESSURE_BY_SYNC,
    Tpdo::spare(4),
    Tpdo::spare(5),
    Tpdo::spare(6),
    Tpdo::spare(7),
];
