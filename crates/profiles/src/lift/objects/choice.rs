//! The virtual devices of the node in the image: the choice (2305h), the objects that depend on it (1000h, 6000h), and
//! the TPDOs of the virtual devices whose CAN-ID only one device of the lift may use.

use super::values::Fields;
use crate::lift::devices::Devices;
use crate::lift::position::UNITS;
use canopen::dictionary::{Dictionary, Field};
use canopen::sdo::Multiplexer;

/// The places of these values.
#[derive(Debug)]
pub(super) struct Choice {
    device_type: Field,
    devices: Field,
    count: Field,
    types: [Field; Devices::KINDS],
    load: CobId,
    positions: [CobId; UNITS],
}

/// The COB-ID of a TPDO with a fixed CAN-ID.
#[derive(Clone, Copy, Debug)]
struct CobId(Field);

/// Flag of a COB-ID: the PDO does not exist.
const OFF: u32 = 1 << 31;

impl CobId {
    const fn of(d: &Dictionary, communication: u16) -> CobId {
        CobId(d.field(communication, 1))
    }

    #[inline(never)]
    fn switch(self, is_on: bool, image: &mut [u8]) {
        let CobId(field) = self;
        put(field, field.u32(image) & !OFF | if is_on { 0 } else { OFF }, image);
    }
}

impl Choice {
    pub(super) const fn new(d: &Dictionary) -> Choice {
        Choice {
            device_type: d.field(0x1000, 0),
            devices: d.field(0x2305, 0),
            count: d.field(0x6000, 0),
            types: [d.field(0x6000, 1), d.field(0x6000, 2), d.field(0x6000, 3), d.field(0x6000, 4)],
            load: CobId::of(d, 0x1901),
            positions: [
                CobId::of(d, 0x1906),
                CobId::of(d, 0x1907),
                CobId::of(d, 0x1980),
                CobId::of(d, 0x1981),
            ],
        }
    }

    pub(super) fn devices(&self, image: &[u8]) -> Devices {
        Devices(self.devices.u8(image))
    }

    /// Writes the device type and the list of virtual devices.
    fn show(&self, devices: Devices, image: &mut [u8]) {
        let (types, count) = devices.types();
        put(self.device_type, devices.device_type(), image);
        put(self.count, u32::try_from(count).unwrap_or(0), image);
        for (at, code) in self.types.iter().zip(types) {
            put(*at, code.into(), image);
        }
    }
}

/// Not inlined: this crate is compiled for speed, and a change of the choice is not urgent.
#[inline(never)]
fn put(at: Field, value: u32, image: &mut [u8]) {
    at.set(image, &value.to_le_bytes());
}

impl Fields {
    /// Makes the node these virtual devices: TPDOs of all other virtual devices are switched off. `begins` is true for
    /// a new choice (2305h), which also switches the chosen TPDOs on, and false after a reset.
    #[inline(never)]
    pub(super) fn choose(&self, devices: Devices, begins: bool, image: &mut [u8]) {
        self.choice.show(devices, image);
        let has_load = devices.has(Devices::LOAD);
        if begins || !has_load {
            self.choice.load.switch(has_load, image);
        }
        for (unit, cob_id) in self.units.iter().zip(&self.choice.positions) {
            let is_there = devices.has(Devices::POSITION) && unit.source.u8(image) != 0;
            if begins || !is_there {
                cob_id.switch(is_there, image);
            }
        }
    }

    /// Switches the TPDO of a position unit on or off.
    #[inline(never)]
    pub(super) fn switch_position(&self, number: usize, is_on: bool, image: &mut [u8]) {
        if let Some(cob_id) = self.choice.positions.get(number) {
            cob_id.switch(is_on, image);
        }
    }

    /// Whether an object belongs to a virtual device, and to a unit of it, that the node has.
    #[inline(never)]
    pub(super) fn is_there(&self, at: Multiplexer, image: &[u8]) -> bool {
        let devices = self.devices(image);
        match at.index {
            0x2313 | 0x6480 | 0x6482 => devices.has(Devices::LOAD),
            0x2303 | 0x6383..=0x63C5 => {
                let unit = self.units.get(usize::from(at.sub).wrapping_sub(1));
                devices.has(Devices::POSITION) && unit.is_some_and(|unit| unit.source.u8(image) != 0)
            }
            _ => true,
        }
    }
}
