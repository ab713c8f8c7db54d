//! The services of CANopenNode: NMT, heartbeat producer and consumer, EMCY, SYNC, four PDOs each way, SDO with block
//! transfer and CRC, LSS.
#![no_std]
#![no_main]

#[path = "ours/driver.rs"]
mod driver;
#[path = "ours/node.rs"]
mod node;

use core::mem::MaybeUninit;

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::{Application, objects};
use cortex_m_rt::entry;

/// One loop calls the device, as CANopenNode's example does.
const HALVES: bool = false;

type Measured = canopen::device!(Keeper, ROWS);

/// An application without behaviour.
struct Keeper;

impl Application for Keeper {
    const BUS_SHARE: bool = false;
    const CONDITIONS: &'static [canopen::Condition] = &[canopen::Condition::new(0x1000)];
}

const fn input(number: u16) -> Object {
    Object::new(0x6000 + number, 0, "", Type::Integer32, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn output(number: u16) -> Object {
    Object::new(0x6200 + number, 0, "", Type::Integer32, Access::ReadWrite).mappable(Mapping::Rpdo)
}

const fn rpdo(number: u16) -> [Object; 13] {
    objects::rpdo(number, &[output(2 * number), output(2 * number + 1)])
}

const fn tpdo(number: u16) -> [Object; 15] {
    objects::without_remote(objects::tpdo(number, &[input(2 * number), input(2 * number + 1)]))
}

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(1000)],
    objects::error_field::<9>(),
    objects::sync_consumer(),
    objects::emergency(),
    objects::heartbeat_consumer::<5>(),
    objects::identity(0x1A, 0x2B, 1),
    objects::error_behaviour(0),
    rpdo(1),
    rpdo(2),
    rpdo(3),
    rpdo(4),
    tpdo(1),
    tpdo(2),
    tpdo(3),
    tpdo(4),
    [input(2), input(3), input(4), input(5), input(6), input(7), input(8), input(9)],
    [output(2), output(3), output(4), output(5), output(6), output(7), output(8), output(9)],
);

static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<node::Ours> = MaybeUninit::uninit();
    node::run(NODE, Keeper)
}
