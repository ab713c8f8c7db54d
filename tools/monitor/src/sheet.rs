//! Data sheets: what a monitor knows of a node without the bus.

use std::collections::{BTreeMap, BTreeSet};

use crate::Key;

/// The kind of an object, as far as the rules depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A parameter: holds what a client has written until the next write or reset.
    Parameter,
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

impl Sheet {
    /// Whether a client's value of the object must last. Without a data sheet: the communication parameters that CiA
    /// 301 defines.
    pub(crate) fn is_parameter(sheet: Option<&Sheet>, key: Key) -> bool {
        match sheet {
            Some(sheet) => sheet.entries.get(&key).is_some_and(|entry| entry.kind == Kind::Parameter),
            None => matches!(
                key.0,
                0x1005..=0x1007 | 0x1012 | 0x1014..=0x1017 | 0x1019 | 0x1029 | 0x1200..=0x1BFF | 0x1F80
            ),
        }
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
