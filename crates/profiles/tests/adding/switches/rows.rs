//! The objects of CiA 401 for eight digital inputs and outputs, and manufacturer-specific counters.

use canopen::dictionary::{Access, DefaultValue, Group, Mapping, Object, Type};
use profiles::communication::{RPDOS, Tpdo, device_name, device_type, error_behaviour, tpdo_mappings, tpdos};

const TPDOS: [Tpdo; 1] = [Tpdo {
    number: 0,
    cob_id: DefaultValue::NodeId(0x180),
    transmission: 255,
    event_timer: 0,
    mapped: &[0x6000_0108],
}];

pub(super) const ROWS: &[&[Object]] = &[
    &[device_type(0x0003_0191)],
    &[device_name("Switches")],
    &error_behaviour(0),
    &RPDOS,
    tpdos(&TPDOS).as_flattened(),
    tpdo_mappings(&TPDOS).as_flattened(),
    &[
        Object::highest(0x2400, 2, "Counts"),
        Object::new(0x2400, 1, "Count of switch 1", Type::Unsigned16, Access::ReadOnly)
            .mappable(Mapping::Tpdo),
        Object::new(0x2400, 2, "Count of switch 2", Type::Unsigned16, Access::ReadOnly)
            .mappable(Mapping::Tpdo),
        Object::new(0x2401, 0, "Zero counts", Type::Unsigned32, Access::WriteOnly).handled(),
        Object::new(0x2402, 0, "Accepted commands", Type::Unsigned8, Access::ReadOnly),
        Object::new(0x2403, 0, "Inputs at the last SYNC", Type::Unsigned8, Access::ReadOnly)
            .mappable(Mapping::Tpdo),
        Object::highest(0x6000, 1, "Read input 8 bit"),
        Object::new(0x6000, 1, "Inputs 1 to 8", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo),
        Object::highest(0x6002, 1, "Polarity input 8 bit"),
        Object::new(0x6002, 1, "Polarity of inputs 1 to 8", Type::Unsigned8, Access::ReadWrite)
            .stored(Group::Application),
        Object::highest(0x6200, 1, "Write output 8 bit"),
        Object::new(0x6200, 1, "Outputs 1 to 8", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo),
        Object::highest(0x6206, 1, "Error mode output 8 bit"),
        Object::new(0x6206, 1, "Error mode of outputs 1 to 8", Type::Unsigned8, Access::ReadWrite)
            .value(0xFF)
            .stored(Group::Application),
        Object::highest(0x6207, 1, "Error value output 8 bit"),
        Object::new(0x6207, 1, "Error value of outputs 1 to 8", Type::Unsigned8, Access::ReadWrite)
            .stored(Group::Application),
    ],
];
