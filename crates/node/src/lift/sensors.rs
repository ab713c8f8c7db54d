//! The position sensors of the lift are described as those of the encoder are: 2100h to 2106h.

use super::rules;
use crate::encoder;
use canopen::dictionary::{Object, Rule};

/// The encoder's rows that describe sensors; those after them belong to CiA 406. A change of what a sensor is goes by the
/// rule of the lift.
pub(super) static OBJECTS: [Object; SENSORS.len()] = {
    let mut rows = [SENSORS[0]; SENSORS.len()];
    let mut i = 0;
    while i < SENSORS.len() {
        rows[i] = SENSORS[i];
        if matches!(rows[i].rule, Rule::Application(_)) {
            rows[i].rule = Rule::Application(rules::SENSOR);
        }
        i += 1;
    }
    rows
};

const SENSORS: &[Object] = before(encoder::SENSORS, 0x2107);

const fn before(rows: &'static [Object], index: u16) -> &'static [Object] {
    let mut count = 0;
    while count < rows.len() && rows[count].index < index {
        count += 1;
    }
    rows.split_at(count).0
}
