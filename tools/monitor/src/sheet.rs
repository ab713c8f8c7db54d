//! Data sheets: what a monitor knows of a node without the bus.

use std::collections::{BTreeMap, BTreeSet};

use canopen::dictionary::{Access, DefaultValue, Group, Mapping, Object, Rule, Type};

use crate::Key;

/// The kind of an object, as far as the rules depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A parameter: holds what a client has written until the next write or reset.
    Parameter,
    /// A parameter that an RPDO may change, too.
    Received,
    /// A measured value, a command or a domain: may read differently at any time.
    Volatile,
}

/// The value after a reset, while nothing is saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Initial {
    /// These bytes, as an upload gives them.
    Bytes(Vec<u8>),
    /// The node-ID plus this number, as UNSIGNED32.
    NodeId(u32),
    /// Not known.
    Unknown,
}

/// The storage group of a parameter: the sub-index of 1010h that saves it.
pub(crate) const COMMUNICATION: u8 = 2;
/// The application parameters.
pub(crate) const APPLICATION: u8 = 3;

/// An object of a data sheet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Kind of the object.
    pub kind: Kind,
    /// Value after a reset.
    pub initial: Initial,
    /// The sub-index of 1010h that saves the value; `None` if none does.
    pub group: Option<u8>,
}

/// A data sheet.
#[derive(Clone, Debug, Default)]
pub struct Sheet {
    /// The objects.
    pub entries: BTreeMap<Key, Entry>,
    /// Emergency error codes after which the node acts as 1029h:1 (communication error) demands.
    pub communication_errors: Vec<u16>,
    /// Emergency error codes after which the node acts as 1029h:2 demands.
    pub device_errors: Vec<u16>,
    /// Objects outside the communication profile that change the parameters of PDOs.
    pub changes_pdos: BTreeSet<u16>,
    /// Whether 1003h is empty after a boot-up.
    pub forgets_errors: bool,
}

/// The sheet of a dictionary made with crate `canopen`.
impl From<&[Object]> for Sheet {
    fn from(rows: &[Object]) -> Sheet {
        let is_timer = |row: &&Object| matches!(row.rule(), Rule::EventTimerOf(_));
        Sheet {
            entries: rows.iter().map(|row| ((row.index, row.sub), Entry::of(row))).collect(),
            changes_pdos: rows.iter().filter(is_timer).map(|row| row.index).collect(),
            forgets_errors: true,
            ..Sheet::default()
        }
    }
}

impl Entry {
    fn of(row: &Object) -> Entry {
        let is_value = row.access == Access::ReadWrite && row.kind != Type::Domain;
        let is_list = matches!(row.rule(), Rule::ErrorCount | Rule::ScannerLine);
        let kind = match row.mapping {
            Mapping::Rpdo | Mapping::Both if is_value => Kind::Received,
            _ if is_value && row.group.is_some() && !row.rule().is_command() && !is_list => Kind::Parameter,
            _ => Kind::Volatile,
        };
        let group = match row.group {
            Some(Group::Communication) => Some(COMMUNICATION),
            Some(Group::Application) => Some(APPLICATION),
            _ => None,
        };
        let size = usize::from(row.kind.size());
        let initial = match row.default {
            DefaultValue::Integer(value) if size <= 8 => Initial::Bytes(value.to_le_bytes()[..size].to_vec()),
            DefaultValue::Real(value) => Initial::Bytes(value.to_le_bytes().to_vec()),
            DefaultValue::NodeId(base) => Initial::NodeId(base),
            _ => Initial::Unknown,
        };
        Entry { kind, initial, group }
    }
}

/// Objects of this project: the personality, and the choice of virtual devices of a lift.
pub(crate) const PERSONALITY: u16 = 0x2000;
const VIRTUAL_DEVICES: u16 = 0x2305;

impl Sheet {
    /// The sheet of a node of this project, some of whose own objects change the parameters of PDOs.
    #[must_use]
    pub fn of_node(rows: &[Object]) -> Sheet {
        let mut sheet = Sheet::from(rows);
        sheet.changes_pdos.extend([PERSONALITY, VIRTUAL_DEVICES]);
        sheet
    }

    /// Whether a client's value of the object must last. Without a data sheet: the communication parameters that CiA
    /// 301 defines.
    pub(crate) fn is_parameter(sheet: Option<&Sheet>, key: Key) -> bool {
        match sheet {
            Some(sheet) => sheet.entries.get(&key).is_some_and(|entry| entry.kind == Kind::Parameter),
            None => Sheet::is_communication_parameter(key),
        }
    }

    /// Whether the default of the object is another value of the node, as the span of a pressure (6148h, 6149h), which is
    /// the range of its calibration.
    pub(crate) fn follows_calibration(sheet: Option<&Sheet>, key: Key) -> bool {
        let is_span = matches!(key, (0x6148 | 0x6149 | 0x6948 | 0x6949, 1));
        is_span && sheet.is_some_and(|sheet| sheet.entries.contains_key(&(0x2200, 1)))
    }

    /// Whether CiA 301 and CiA 302 define the object as a communication parameter of every device.
    #[must_use]
    pub fn is_communication_parameter(key: Key) -> bool {
        matches!(
            key.0,
            0x1005..=0x1007 | 0x1012 | 0x1014..=0x1017 | 0x1019 | 0x1029 | 0x1200..=0x1BFF | 0x1F80
        )
    }

    /// Whether the object holds a value, of a client or of an RPDO.
    pub(crate) fn holds_value(sheet: Option<&Sheet>, key: Key) -> bool {
        let is_received =
            |sheet: &Sheet| sheet.entries.get(&key).is_some_and(|entry| entry.kind == Kind::Received);
        Sheet::is_parameter(sheet, key) || sheet.is_some_and(is_received)
    }

    /// Whether a write to the object may change the parameters of PDOs. Without a data sheet: every object of the
    /// manufacturer and of a device profile.
    pub(crate) fn may_change_pdos(sheet: Option<&Sheet>, index: u16) -> bool {
        index >= 0x2000 && sheet.is_none_or(|sheet| sheet.changes_pdos.contains(&index))
    }

    /// The sub-index of 1010h that saves the object.
    pub(crate) fn group(sheet: Option<&Sheet>, key: Key) -> Option<u8> {
        match sheet {
            Some(sheet) => sheet.entries.get(&key)?.group,
            None => Sheet::is_parameter(None, key).then_some(COMMUNICATION),
        }
    }
}
