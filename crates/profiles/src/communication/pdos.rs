//! PDO objects: eight PDOs in each direction. RPDOs are off by default in every personality; the defaults of the TPDOs
//! depend on the personality.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use canopen::dictionary::{self, DefaultValue, Object};
use canopen::objects;

pub use objects::pdo::{cob_id, count, event_timer, inhibit_time, slot, sync_start, transmission_type};

use objects::pdo::{default_id, rpdo_parameter, tpdo_parameter};

/// Number of PDOs in each direction.
pub(crate) const PDOS: usize = 8;

/// A mapping parameter of a PDO that can be a multiplexed one, as each PDO of every personality can.
const fn mapping(index: u16, name: &'static str, mapped: &[i64]) -> [Object; 9] {
    objects::multiplexed(objects::pdo::mapping(index, name, mapped))
}

/// Defaults of a TPDO.
pub struct Tpdo {
    /// Number of the TPDO, from 0.
    pub number: u16,
    /// COB-ID.
    pub cob_id: DefaultValue,
    /// Transmission type.
    pub transmission: i64,
    /// Event timer in ms.
    pub event_timer: i64,
    /// Mapped objects.
    pub mapped: &'static [i64],
}

impl Tpdo {
    /// A TPDO that is off by default. `number` counts from 0.
    #[must_use]
    pub const fn spare(number: u16) -> Tpdo {
        Tpdo { number, cob_id: off(0x180, number), transmission: 255, event_timer: 0, mapped: &[] }
    }
}

/// The default COB-ID of a PDO that is off. The first four PDOs have a CAN-ID in the pre-defined connection set.
#[must_use]
pub const fn off(base: u32, number: u16) -> DefaultValue {
    default_id(base, number + 1, false)
}

const fn tpdo(default: &Tpdo) -> [Object; 6] {
    let (index, name) = (0x1800 + default.number, TPDO_NAMES[default.number as usize][0]);
    let rows = tpdo_parameter(index, name, default.cob_id);
    objects::with(objects::with(rows, 2, default.transmission), 5, default.event_timer)
}

const RPDO_NAMES: [[&str; 2]; PDOS] = [
    ["RPDO 1 communication parameter", "RPDO 1 mapping parameter"],
    ["RPDO 2 communication parameter", "RPDO 2 mapping parameter"],
    ["RPDO 3 communication parameter", "RPDO 3 mapping parameter"],
    ["RPDO 4 communication parameter", "RPDO 4 mapping parameter"],
    ["RPDO 5 communication parameter", "RPDO 5 mapping parameter"],
    ["RPDO 6 communication parameter", "RPDO 6 mapping parameter"],
    ["RPDO 7 communication parameter", "RPDO 7 mapping parameter"],
    ["RPDO 8 communication parameter", "RPDO 8 mapping parameter"],
];

const TPDO_NAMES: [[&str; 2]; PDOS] = [
    ["TPDO 1 communication parameter", "TPDO 1 mapping parameter"],
    ["TPDO 2 communication parameter", "TPDO 2 mapping parameter"],
    ["TPDO 3 communication parameter", "TPDO 3 mapping parameter"],
    ["TPDO 4 communication parameter", "TPDO 4 mapping parameter"],
    ["TPDO 5 communication parameter", "TPDO 5 mapping parameter"],
    ["TPDO 6 communication parameter", "TPDO 6 mapping parameter"],
    ["TPDO 7 communication parameter", "TPDO 7 mapping parameter"],
    ["TPDO 8 communication parameter", "TPDO 8 mapping parameter"],
];

const fn rpdos() -> [[Object; 4]; 8] {
    let mut rows = [rpdo_parameter(0x1400, RPDO_NAMES[0][0], off(0x200, 0)); 8];
    let mut number = 1;
    while number < 8 {
        let name = RPDO_NAMES[number as usize][0];
        rows[number as usize] = rpdo_parameter(0x1400 | number, name, off(0x200, number));
        number += 1;
    }
    rows
}

const fn rpdo_mappings() -> [[Object; 9]; 8] {
    let mut rows = [mapping(0x1600, RPDO_NAMES[0][1], &[]); 8];
    let mut number = 1;
    while number < 8 {
        rows[number as usize] = mapping(0x1600 | number, RPDO_NAMES[number as usize][1], &[]);
        number += 1;
    }
    rows
}

const RPDO_PARTS: &[&[Object]] = &[rpdos().as_flattened(), rpdo_mappings().as_flattened()];

/// 1400h to 1607h: eight RPDOs.
pub static RPDOS: [Object; dictionary::count(RPDO_PARTS)] = dictionary::gather(RPDO_PARTS);

/// Communication parameters of these TPDOs.
#[must_use]
pub const fn tpdos<const N: usize>(defaults: &[Tpdo; N]) -> [[Object; 6]; N] {
    let mut rows = [tpdo(&defaults[0]); N];
    let mut i = 1;
    while i < N {
        rows[i] = tpdo(&defaults[i]);
        i += 1;
    }
    rows
}

/// Mapping parameters of these TPDOs.
#[must_use]
pub const fn tpdo_mappings<const N: usize>(defaults: &[Tpdo; N]) -> [[Object; 9]; N] {
    let mut rows = [mapping(0x1A00, "", &[]); N];
    let mut i = 0;
    while i < N {
        let number = defaults[i].number;
        rows[i] = mapping(0x1A00 | number, TPDO_NAMES[number as usize][1], defaults[i].mapped);
        i += 1;
    }
    rows
}
