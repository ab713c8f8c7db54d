//! The minimal device: NMT, heartbeat, SDO expedited and segmented, one TPDO with dynamic mapping.
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
    const BLOCK_UPLOAD: bool = false;
    const BLOCK_DOWNLOAD: bool = false;
    const LSS: bool = false;
    const BUS_SHARE: bool = false;
}

const INPUT: Object = Object::new(0x6000, 0, "", Type::Integer32, Access::ReadOnly).mappable(Mapping::Tpdo);

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(1000)],
    objects::identity(0x1A, 0x2B, 1),
    objects::without_remote(objects::tpdo(1, &[INPUT])),
    [INPUT],
);

static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<node::Ours> = MaybeUninit::uninit();
    node::run(NODE, Keeper)
}
