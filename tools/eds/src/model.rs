//! A data sheet as a value.

use std::collections::{BTreeMap, BTreeSet};

use crate::{Access, Commissioning, DataType, Formula, ObjectType};

/// A data sheet: the device, and every object it has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eds {
    /// The device.
    pub device: DeviceInfo,
    /// The objects by index.
    pub objects: BTreeMap<u16, Object>,
    /// Which device the values are for; `None` for a data sheet, which has no values.
    pub commissioning: Option<Commissioning>,
}

impl Eds {
    /// The entry of an index and a sub-index.
    #[must_use]
    pub fn get(&self, index: u16, sub: u8) -> Option<&Entry> {
        self.objects.get(&index)?.entries.get(&sub)
    }

    /// All entries, sorted by index and sub-index.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.objects.values().flat_map(|object| object.entries.values())
    }
}

/// Section `[DeviceInfo]`. What a file does not say is 0, empty or false.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name of the vendor.
    pub vendor_name: String,
    /// Object 1018h:1.
    pub vendor_number: u32,
    /// Name of the product.
    pub product_name: String,
    /// Object 1018h:2.
    pub product_number: u32,
    /// Object 1018h:3.
    pub revision_number: u32,
    /// Order code.
    pub order_code: String,
    /// Bit rates it runs at, in kbit/s.
    pub bit_rates: BTreeSet<u16>,
    /// Smallest mappable part of a PDO in bits; 0 where the mapping is fixed.
    pub granularity: u8,
    /// Whether it has multiplexed PDOs.
    pub group_messaging: bool,
    /// Number of RPDOs.
    pub rpdos: u16,
    /// Number of TPDOs.
    pub tpdos: u16,
    /// Whether it is an LSS slave.
    pub lss: bool,
}

/// What is at one index.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Name.
    pub name: String,
    /// Object type.
    pub object_type: ObjectType,
    /// The entries by sub-index; a variable has one, at sub-index 0.
    pub entries: BTreeMap<u8, Entry>,
}

/// What is at one sub-index: all there is to know for a transfer.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Name; that of the object where it is a variable.
    pub name: String,
    /// Data type.
    pub data_type: DataType,
    /// Access.
    pub access: Access,
    /// Value after a reset with nothing saved.
    pub default: Option<Formula>,
    /// The value in a device (`ParameterValue`); only a configuration file has one.
    pub value: Option<Formula>,
    /// Smallest value accepted, where narrower than the type.
    pub low: Option<Formula>,
    /// Largest value accepted, where narrower than the type.
    pub high: Option<Formula>,
    /// Whether a PDO can carry it.
    pub mappable: bool,
    /// Physical unit. CiA 306 has no place for it: it is written as a comment and never read.
    pub unit: String,
}

impl Entry {
    /// Its own object type: a sub-index of an array or a record is a variable or a domain.
    #[must_use]
    pub fn object_type(&self) -> ObjectType {
        if self.data_type == DataType::DOMAIN { ObjectType::Domain } else { ObjectType::Var }
    }

    /// Whether a TPDO can carry it.
    #[must_use]
    pub fn is_tpdo_mappable(&self) -> bool {
        self.mappable && !matches!(self.access, Access::WriteOnly | Access::ReadWriteOutput)
    }

    /// Whether an RPDO can carry it.
    #[must_use]
    pub fn is_rpdo_mappable(&self) -> bool {
        self.mappable
            && matches!(self.access, Access::WriteOnly | Access::ReadWrite | Access::ReadWriteOutput)
    }
}
