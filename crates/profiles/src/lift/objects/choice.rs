//! The virtual devices of the node in the image: the choice (2305h), the objects that depend on it (1000h, 6000h), and
//! the TPDOs of the virtual devices whose CAN-ID only one device of the lift may use. Bit 31 of their COB-IDs follows from
//! the choice, the sensors (2301h) and what a client has switched off (2307h), at every write and after every reset.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use super::manufacturer::SWITCHED_OFF;
use super::values::Fields;
use crate::lift::devices::Devices;
use crate::lift::position::UNITS;
use canopen::dictionary::{Dictionary, Field};
use canopen::sdo::Multiplexer;

/// The TPDOs with a fixed CAN-ID: those of the load and of each position unit.
const TPDOS: [u16; 1 + UNITS] = [0x1901, 0x1906, 0x1907, 0x1980, 0x1981];

/// Value of 2307h for communication parameters that a firmware without this object has stored: the TPDOs that are off
/// although their virtual device is chosen were switched off by a client.
pub const UNKNOWN_CHOICES: u8 = 0x80;

/// The places of these values.
#[derive(Debug)]
pub(super) struct Choice {
    device_type: Field,
    devices: Field,
    count: Field,
    types: [Field; Devices::KINDS],
    /// 2307h, the TPDOs that a client has switched off: one bit for each.
    switched_off: Field,
    /// The COB-IDs of the TPDOs.
    cob_ids: [Field; TPDOS.len()],
}

/// Flag of a COB-ID: the PDO does not exist.
const OFF: u32 = 1 << 31;

impl Choice {
    pub(super) const fn new(d: &Dictionary) -> Choice {
        let mut cob_ids = [d.field(TPDOS[0], 1); TPDOS.len()];
        let mut number = 1;
        while number < TPDOS.len() {
            cob_ids[number] = d.field(TPDOS[number], 1);
            number += 1;
        }
        Choice {
            device_type: d.field(0x1000, 0),
            devices: d.field(0x2305, 0),
            count: d.field(0x6000, 0),
            types: [d.field(0x6000, 1), d.field(0x6000, 2), d.field(0x6000, 3), d.field(0x6000, 4)],
            switched_off: d.field(SWITCHED_OFF, 0),
            cob_ids,
        }
    }

    /// Makes the TPDO valid if its virtual device is there and no client has switched the TPDO off. With `forgets`, it no
    /// longer matters that a client has switched off a TPDO whose virtual device is not there.
    #[inline(never)]
    fn switch(&self, number: usize, is_there: bool, forgets: bool, image: &mut [u8]) {
        let Some(cob_id) = self.cob_ids.get(number) else { return };
        if forgets && !is_there {
            self.note(number, false, image);
        }
        let is_on = is_there && self.switched_off.u8(image) & bit(number) == 0;
        put(*cob_id, cob_id.u32(image) & !OFF | if is_on { 0 } else { OFF }, image);
    }

    /// Notes whether a client has switched the TPDO off.
    #[inline(never)]
    fn note(&self, number: usize, is_off: bool, image: &mut [u8]) {
        let others = self.switched_off.u8(image) & !bit(number);
        put(self.switched_off, u32::from(if is_off { others | bit(number) } else { others }), image);
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

/// The bit of a TPDO in 2307h.
fn bit(number: usize) -> u8 {
    u32::try_from(number).ok().and_then(|number| 1_u8.checked_shl(number)).unwrap_or(0)
}

impl Fields {
    /// Makes the node these virtual devices, and their TPDOs valid. `is_new` is true for a new choice (2305h), and false
    /// after a reset. With a new choice, it no longer matters that a client has switched off a TPDO which is not chosen.
    #[inline(never)]
    pub(super) fn choose(&self, devices: Devices, is_new: bool, image: &mut [u8]) {
        self.choice.show(devices, image);
        let is_unknown = self.choice.switched_off.u8(image) == UNKNOWN_CHOICES;
        if is_unknown {
            put(self.choice.switched_off, 0, image);
        }
        for number in 0..TPDOS.len() {
            let is_there = self.has_tpdo(number, devices, image);
            if is_unknown && is_there {
                self.note(number, image);
            }
            self.choice.switch(number, is_there, is_new, image);
        }
    }

    /// Whether the virtual device of a TPDO is chosen, and has a sensor.
    #[inline(never)]
    fn has_tpdo(&self, number: usize, devices: Devices, image: &[u8]) -> bool {
        match number.checked_sub(1).and_then(|unit| self.units.get(unit)) {
            Some(unit) => devices.has(Devices::POSITION) && unit.source.u8(image) != 0,
            None => devices.has(Devices::LOAD),
        }
    }

    /// The TPDO of a position unit follows the sensor of the unit.
    #[inline(never)]
    pub(super) fn switch_position(&self, unit: usize, has_sensor: bool, image: &mut [u8]) {
        let is_there = has_sensor && self.devices(image).has(Devices::POSITION);
        self.choice.switch(unit.wrapping_add(1), is_there, !has_sensor, image);
    }

    /// Notes whether a client has switched the TPDO off.
    #[inline(never)]
    fn note(&self, number: usize, image: &mut [u8]) {
        let is_off = self.choice.cob_ids.get(number).is_some_and(|cob_id| cob_id.u32(image) & OFF != 0);
        self.choice.note(number, is_off, image);
    }

    /// A client has written the COB-ID of a TPDO.
    #[inline(never)]
    pub(super) fn note_switch(&self, communication: u16, image: &mut [u8]) {
        if let Some(number) = TPDOS.iter().position(|index| *index == communication) {
            self.note(number, image);
        }
    }

    /// Whether an object belongs to a virtual device, and to one of its units, that the node has.
    #[inline(never)]
    pub(super) fn is_there(&self, at: Multiplexer, image: &[u8]) -> bool {
        let devices = self.devices(image);
        match at.index {
            0x2313 | 0x6480 | 0x6482 => devices.has(Devices::LOAD),
            // Each change of a speed would be a frame.
            0x6390 => false,
            0x2303 | 0x6383..=0x63C5 => {
                let number = if let 0x63B0..=0x63BB = at.index {
                    at.index & 3
                } else {
                    u16::from(at.sub).wrapping_sub(1)
                };
                let unit = self.units.get(usize::from(number));
                devices.has(Devices::POSITION) && unit.is_some_and(|unit| unit.source.u8(image) != 0)
            }
            _ => true,
        }
    }
}
