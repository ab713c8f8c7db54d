//! The configuration of a device: the values of all parameters, from the device itself or from a file (CiA 306).

mod cob_id;
mod file;
mod plan;
mod services;

use std::collections::BTreeMap;

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{Class, Eds, Entry, Formula};

use crate::object::at;
use crate::sdo::Error;
use crate::value::Value;

pub use file::Dcf;
pub use plan::{Write, looked_at, plan};

/// Values by index and sub-index.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// The values.
    pub values: BTreeMap<(u16, u8), Value>,
}

/// A parameter whose values differ, or that only one configuration has.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The parameter.
    pub at: Multiplexer,
    /// The value in the first configuration.
    pub first: Option<Value>,
    /// The value in the second configuration.
    pub second: Option<Value>,
}

/// Whether an entry is a parameter: readable and writable, no domain, and not excluded by the data sheet (`ObjFlags`).
/// In a data sheet without these flags, commands of CiA 301 and 302 are no parameters, and neither are entries that an
/// RPDO can write, unless the file has a value for them: they may be process values, which move a drive.
#[must_use]
pub fn is_parameter(entry: &Entry) -> bool {
    let has_value = !matches!(entry.data_type, eds::DataType::DOMAIN);
    let is_open = entry.access.is_readable() && entry.access.is_writable();
    is_open && has_value && !is_excluded(entry)
}

fn is_excluded(entry: &Entry) -> bool {
    match entry.flags {
        Some(flags) => flags.refuse_write(),
        None => is_command(entry.index) || is_unclear(entry),
    }
}

/// Whether a write to an object makes the device act (CiA 301, CiA 302-3).
fn is_command(index: u16) -> bool {
    matches!(index, 0x1003 | 0x1010 | 0x1011 | 0x1F50..=0x1F5F)
}

/// Whether an entry may be a parameter or a process value: the data sheet does not say.
#[must_use]
pub fn is_unclear(entry: &Entry) -> bool {
    entry.flags.is_none() && entry.access.is_readable() && entry.is_rpdo_mappable() && entry.value.is_none()
}

impl Configuration {
    /// The values of a data sheet or a configuration file, for a node. Where there is no value, the default. COB-IDs that
    /// follow the node-ID are those of `node`, whatever the node-ID in the file.
    #[must_use]
    pub fn of_sheet(sheet: &Eds, node: NodeId) -> Configuration {
        let of_file = node_of(sheet).unwrap_or(node);
        let value = |entry: &Entry| {
            let written = entry.value.as_ref().or(entry.default.as_ref())?;
            let following = cob_id::formula(entry, &decode(written, entry, of_file)?, of_file);
            let value = decode(following.as_ref().unwrap_or(written), entry, node)?;
            Some(((entry.index, entry.sub), value))
        };
        Configuration {
            values: sheet.entries().filter(|entry| is_parameter(entry)).filter_map(value).collect(),
        }
    }

    /// The values of a device. `read` reads an object. `progress` is called with the number of parameters read and the
    /// total.
    ///
    /// # Errors
    /// SDO errors, except refusals of objects that the device does not have or does not tell.
    pub fn of_node(
        mut read: impl FnMut(Multiplexer) -> Result<Vec<u8>, Error>,
        sheet: &Eds,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<Configuration, Error> {
        let parameters: Vec<&Entry> = sheet.entries().filter(|entry| is_parameter(entry)).collect();
        let mut values = BTreeMap::new();
        for (number, entry) in parameters.iter().enumerate() {
            progress(number, parameters.len());
            match read(at(entry.index, entry.sub)) {
                Ok(bytes) => {
                    values.insert((entry.index, entry.sub), faithful(&bytes, entry.data_type));
                }
                Err(error) if error.abort().is_some() => (),
                Err(error) => return Err(error),
            }
        }
        Ok(Configuration { values })
    }

    /// The parameters in which this configuration differs from another.
    #[must_use]
    pub fn differences(&self, other: &Configuration) -> Vec<Difference> {
        let mut keys: Vec<(u16, u8)> = self.values.keys().chain(other.values.keys()).copied().collect();
        keys.sort_unstable();
        keys.dedup();
        let difference = |key: (u16, u8)| {
            let (first, second) = (self.values.get(&key).cloned(), other.values.get(&key).cloned());
            (!same(first.as_ref(), second.as_ref())).then(|| Difference {
                at: at(key.0, key.1),
                first,
                second,
            })
        };
        keys.into_iter().filter_map(difference).collect()
    }

    /// The parameters to which a wanted configuration gives another value. The steps that lead to them, such as those of a
    /// PDO, are not among them: [`plan`] has these.
    #[must_use]
    pub fn changes(&self, wanted: &Configuration) -> Vec<Difference> {
        let mut differences = self.differences(wanted);
        differences.retain(|difference| difference.second.is_some());
        differences
    }
}

/// The node-ID that a file is for.
#[must_use]
pub fn node_of(sheet: &Eds) -> Option<NodeId> {
    sheet.commissioning.as_ref().and_then(|to| NodeId::new(to.node_id))
}

/// The value in these bytes, which stay bytes where a text does not have all of them, as with Latin-1. Zeros behind a text
/// only pad it.
fn faithful(bytes: &[u8], data_type: eds::DataType) -> Value {
    let value = Value::decode(bytes, data_type);
    let Value::Text(_) = value else { return value };
    let rest = bytes.strip_prefix(value.encode(data_type).as_slice());
    let has_all = rest.is_some_and(|rest| rest.iter().all(|byte| *byte == 0));
    if has_all { value } else { Value::Bytes(bytes.to_vec()) }
}

/// Whether two values are equal. NaN is equal to NaN.
fn same(first: Option<&Value>, second: Option<&Value>) -> bool {
    match (first, second) {
        (Some(Value::Real32(a)), Some(Value::Real32(b))) => a.to_bits() == b.to_bits() || a == b,
        (first, second) => first == second,
    }
}

fn decode(formula: &Formula, entry: &Entry, node: NodeId) -> Option<Value> {
    Some(match (formula.evaluate(node), entry.data_type.class()) {
        (eds::Value::Integer(value), _) => Value::Integer(value),
        #[allow(clippy::cast_possible_truncation)] // The number was a REAL32 in the file.
        (eds::Value::Real(value), Class::Real(32)) => Value::Real32(value as f32),
        (eds::Value::Real(value), _) => Value::Real64(value),
        (eds::Value::Text(text), Class::Text) => Value::Text(text),
        (eds::Value::Text(text), _) => return Value::parse(&text, entry.data_type).ok(),
    })
}
