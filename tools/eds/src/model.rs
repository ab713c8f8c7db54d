//! A data sheet as a value.

use std::collections::{BTreeMap, BTreeSet};

use crate::{Access, Commissioning, DataType, Error, Formula, ObjectType};

/// A data sheet: the device and all its objects.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eds {
    /// The device.
    pub device: DeviceInfo,
    /// The objects by index.
    pub objects: BTreeMap<u16, Object>,
    /// The device that the values are for; `None` for a data sheet, which has no values.
    pub commissioning: Option<Commissioning>,
    /// The mistakes of the file that was read, in the order of its lines.
    pub warnings: Vec<Error>,
}

impl Eds {
    /// The entry of an index and a sub-index.
    #[must_use]
    pub fn get(&self, index: u16, sub: u8) -> Option<&Entry> {
        self.objects.get(&index)?.entries.get(&sub)
    }

    /// Removes the flags of all entries where the data sheet does not use them. Editors write `ObjFlags=0` everywhere.
    /// An author who means the flags excludes the command that stores the parameters.
    pub(crate) fn drop_unused_flags(&mut self) {
        let refuses = |entry: &Entry| entry.flags.is_some_and(Flags::refuse_write);
        if !self.get(0x1010, 1).is_some_and(refuses) {
            let entries = self.objects.values_mut().flat_map(|object| object.entries.values_mut());
            entries.for_each(|entry| entry.flags = None);
        }
    }

    /// All entries, sorted by index and sub-index.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.objects.values().flat_map(|object| object.entries.values())
    }
}

/// Section `[DeviceInfo]`. Values that a file leaves out are 0, empty or false.
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
    /// Supported bit rates in kbit/s.
    pub bit_rates: BTreeSet<u16>,
    /// Smallest mappable part of a PDO in bits; 0 where the mapping is fixed.
    pub granularity: u8,
    /// Whether the device has multiplexed PDOs.
    pub group_messaging: bool,
    /// Number of RPDOs.
    pub rpdos: u16,
    /// Number of TPDOs.
    pub tpdos: u16,
    /// Whether the device is an LSS slave.
    pub lss: bool,
}

/// An object: all entries of one index.
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

/// An entry: an index and a sub-index, with all data that a transfer needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Name of the entry; for a variable, the name of the object.
    pub name: String,
    /// Data type.
    pub data_type: DataType,
    /// Access.
    pub access: Access,
    /// Value after a reset with nothing saved.
    pub default: Option<Formula>,
    /// The value in a device (`ParameterValue`). Only a configuration file has values.
    pub value: Option<Formula>,
    /// Smallest value accepted, where narrower than the type.
    pub low: Option<Formula>,
    /// Largest value accepted, where narrower than the type.
    pub high: Option<Formula>,
    /// Whether a PDO can carry the entry.
    pub mappable: bool,
    /// Actions that a master leaves out for the entry (`ObjFlags`); `None` in a data sheet that does not use the flags.
    pub flags: Option<Flags>,
    /// Physical unit. CiA 306 has no place for units: they are written as a comment and never read.
    pub unit: String,
}

/// `ObjFlags` of an entry (CiA 306).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u32);

impl Flags {
    /// Bit 0: the entry is not written when a configuration is downloaded.
    #[must_use]
    pub fn refuse_write(self) -> bool {
        self.0 & 1 != 0
    }

    /// Bit 1: the entry is not read when the device is scanned.
    #[must_use]
    pub fn refuse_read(self) -> bool {
        self.0 & 2 != 0
    }
}

impl Entry {
    /// The object type of the entry alone: a sub-index of an array or a record is a variable or a domain.
    #[must_use]
    pub fn object_type(&self) -> ObjectType {
        if self.data_type == DataType::DOMAIN { ObjectType::Domain } else { ObjectType::Var }
    }

    /// Whether a TPDO can carry the entry.
    #[must_use]
    pub fn is_tpdo_mappable(&self) -> bool {
        self.mappable && !matches!(self.access, Access::WriteOnly | Access::ReadWriteOutput)
    }

    /// Whether an RPDO can carry the entry.
    #[must_use]
    pub fn is_rpdo_mappable(&self) -> bool {
        self.mappable
            && matches!(self.access, Access::WriteOnly | Access::ReadWrite | Access::ReadWriteOutput)
    }
}
