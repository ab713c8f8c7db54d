//! TPDO 1 and 2 are those of the transmitter, without a SYNC start value and with at most four mapped objects. The
//! other TPDOs are not used by default.

use crate::communication::{
    RPDOS, Tpdo, cob_id, count, event_timer, inhibit_time, off, slot, tpdo_mappings, tpdos, transmission_type,
};
use canopen::dictionary::{DefaultValue, Object};

const fn transmitter(index: u16, name: &'static str, default: DefaultValue) -> [Object; 5] {
    let highest = Object::highest(index, 5, name);
    [
        highest,
        cob_id(index, default),
        transmission_type(index, 255),
        inhibit_time(index),
        event_timer(index, 1000),
    ]
}

const TPDO1: [Object; 5] = transmitter(0x1800, "TPDO 1 communication parameter", DefaultValue::NodeId(0x180));
const TPDO2: [Object; 5] = transmitter(0x1801, "TPDO 2 communication parameter", off(0x180, 1));

const TRANSMITTER_MAPPING: &[Object] = &[
    count(0x1A00, "TPDO 1 mapping parameter", 2).limits(0, 4),
    slot(0x1A00, 1, 0x6130_0120),
    slot(0x1A00, 2, 0x6130_0220),
    slot(0x1A00, 3, 0),
    slot(0x1A00, 4, 0),
    count(0x1A01, "TPDO 2 mapping parameter", 0).limits(0, 4),
    slot(0x1A01, 1, 0),
    slot(0x1A01, 2, 0),
    slot(0x1A01, 3, 0),
    slot(0x1A01, 4, 0),
];

const SPARE: [Tpdo; 6] =
    [Tpdo::spare(2), Tpdo::spare(3), Tpdo::spare(4), Tpdo::spare(5), Tpdo::spare(6), Tpdo::spare(7)];

/// All parts, in the order of the table.
pub(super) const PARTS: &[&[Object]] = &[
    &RPDOS,
    &TPDO1,
    &TPDO2,
    tpdos(&SPARE).as_flattened(),
    TRANSMITTER_MAPPING,
    tpdo_mappings(&SPARE).as_flattened(),
];
