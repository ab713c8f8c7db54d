//! The rows of a data sheet. What the library's device cannot do is left out with a note.

use std::collections::BTreeMap;
use std::panic::catch_unwind;

use canopen::NodeId;
use canopen::dictionary::{
    self, Access as RowAccess, DefaultValue, Dictionary, Group, Mapping, Object, Rule, TableBuilder, Tables,
    Type,
};
use eds::{Access, Class, DataType, Eds, Entry, Formula};
use thiserror::Error;

use super::node::ROOM;
use super::pdos;
use crate::object::{Place, at};
use crate::value::Value;

/// The longest value of the library in bytes.
const LONGEST: u8 = 112;
/// The space of a text in bytes, where the data sheet does not tell it.
const TEXT: usize = 32;
/// The number of errors that the library lists in 1003h.
const ERRORS: u8 = 10;
/// The largest tables of the library: places and series, attributes, bytes of defaults.
const MAX: usize = 1024;
const MAX_ATTRIBUTES: usize = 256;
const MAX_DEFAULTS: usize = 1 << 16;

/// The table of a data sheet.
#[derive(Clone, Debug)]
pub struct Table {
    /// The dictionary for the library's device.
    pub dictionary: &'static Dictionary,
    /// Values that no row can have as a default: texts of 16-bit characters, bytes, and large numbers of UNSIGNED64.
    pub values: Vec<((u16, u8), Vec<u8>)>,
    /// Omissions and changes, in words.
    pub notes: Vec<String>,
}

/// The library's device cannot have the table.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TableError {
    /// The values need more memory than there is.
    #[error("the values of the data sheet have {0} bytes, and a simulated device has room for {image}", image = ROOM.image)]
    Large(usize),
    /// A rule of the library's tables.
    #[error("no device can be made of the data sheet: {0}")]
    Rule(String),
}

/// The rows, and what they do not tell.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) rows: BTreeMap<(u16, u8), Object>,
    pub(super) values: Vec<((u16, u8), Vec<u8>)>,
    pub(super) notes: Vec<String>,
}

impl Table {
    /// The table of a data sheet. Values that depend on the node-ID without being a COB-ID are those of `node`. The memory
    /// of the table is never freed.
    ///
    /// # Errors
    /// The library's device cannot have such a table.
    pub fn new(sheet: &Eds, node: Option<NodeId>) -> Result<Table, TableError> {
        let Rows { rows, values, notes } = Rows::of(sheet, node);
        let rows: Vec<Object> = rows.into_values().collect();
        let size = dictionary::image_size(&rows);
        if size > ROOM.image {
            return Err(TableError::Large(size));
        }
        Ok(Table { dictionary: compile(&rows)?, values, notes })
    }
}

/// The run-time tables. The library checks rows by panics, because it compiles them as a rule.
fn compile(rows: &[Object]) -> Result<&'static Dictionary, TableError> {
    let words = |payload: Box<dyn std::any::Any + Send>| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        text.or(payload.downcast_ref::<&str>().copied()).unwrap_or("the table is too large").to_owned()
    };
    let tables: Box<Tables<1, MAX, MAX, MAX_ATTRIBUTES, MAX_DEFAULTS>> =
        catch_unwind(|| Box::new(dictionary::compile(&TableBuilder::checked(&[rows]))))
            .map_err(|payload| TableError::Rule(words(payload)))?;
    let [dictionary] = Box::leak(tables).dictionaries();
    Ok(Box::leak(Box::new(dictionary)))
}

impl Rows {
    pub(super) fn of(sheet: &Eds, node: Option<NodeId>) -> Rows {
        let mut all = Rows::default();
        let node = node.or(NodeId::new(1)).unwrap_or_else(|| unreachable!("1 is a node-ID"));
        let stores = sheet.objects.contains_key(&0x1010);
        for entry in sheet.entries() {
            all.add(entry, node, stores);
        }
        all.complete();
        pdos::repair(&mut all);
        all
    }

    /// Notes what is left out.
    pub(super) fn note(&mut self, (index, sub): (u16, u8), what: &str) {
        self.notes.push(format!("{}: {what}", Place(at(index, sub))));
    }

    fn add(&mut self, entry: &Entry, node: NodeId, stores: bool) {
        let key = (entry.index, entry.sub);
        if let Some(why) = left_out(entry) {
            return self.note(key, why);
        }
        let formula = entry.value.as_ref().or(entry.default.as_ref());
        let value = formula.and_then(|formula| bytes(formula, entry.data_type, node));
        let Some(kind) = kind(entry.data_type, value.as_deref()) else {
            return self.note(key, "left out: the data type is unknown");
        };
        let mut row = Object::new(entry.index, entry.sub, "", kind, access(entry.access));
        if row.rule().size().is_some_and(|size| size != kind.size()) {
            return self.note(key, "left out: the data type is not that of CiA 301");
        }
        row.default = default(formula, kind, node, row.default);
        row.limits = limits(entry, kind, node).filter(|limits| is_within(row.default, *limits));
        row.mapping = mapping(entry, &row);
        row.group = Some(group(entry.index)).filter(|_| stores && is_stored(entry, &row));
        match (entry.index, entry.sub) {
            // The simulated device has no program.
            (0x1F51, 1) => row = row.with(Rule::Application),
            (0x1005, 0) => row = row.with(Rule::SyncProducer),
            // The pre-defined COB-ID, where the data sheet has none that can be read.
            (0x1014, 0) if formula.is_none() => row.default = DefaultValue::NodeId(0x80),
            _ => (),
        }
        if let Some(value) = value.filter(|value| has_no_default(kind, value)) {
            self.values.push((key, value));
        }
        self.rows.insert(key, row);
    }

    /// Adds a sub-index 0 to each object that lacks it, and removes what the library refuses beyond a row.
    fn complete(&mut self) {
        let mut highest = BTreeMap::new();
        for (index, sub) in self.rows.keys() {
            highest.insert(*index, *sub);
        }
        for (index, sub) in highest {
            self.rows.entry((index, 0)).or_insert_with(|| Object::highest(index, sub, ""));
        }
        // SYNC needs its period, and the further SDO servers have no gap.
        if !self.rows.contains_key(&(0x1006, 0))
            && let Some(sync) = self.rows.get_mut(&(0x1005, 0))
        {
            *sync = sync.with(Rule::SyncCobId);
            sync.default = match sync.default {
                DefaultValue::Integer(value) => DefaultValue::Integer(value & !(1 << 30)),
                other => other,
            };
        }
        let gap = (0x1201..0x1280).find(|index| !self.rows.contains_key(&(*index, 0))).unwrap_or(0x1280);
        self.rows.retain(|(index, _), _| !(gap..0x1280).contains(index));
    }
}

/// Why the library has no such entry.
fn left_out(entry: &Entry) -> Option<&'static str> {
    match (entry.index, entry.sub) {
        // A definition of a type, no object.
        (..0x1000, _) => Some("left out: it describes a data type"),
        (_, u8::MAX) => Some("left out: it describes the object"),
        (0x1003, sub) if sub > ERRORS => Some("left out: the list has ten errors"),
        (0x1010 | 0x1011, sub) if sub > 8 => Some("left out: there are eight groups of parameters"),
        (0x1028, sub) if sub > 127 => Some("left out: the sub-index is a node-ID"),
        // The scanner list is for multiplexed PDOs.
        (0x1FA0..=0x1FCF, _) => Some("left out: there are no multiplexed PDOs"),
        _ => None,
    }
}

fn access(access: Access) -> RowAccess {
    match access {
        Access::Const => RowAccess::Const,
        Access::ReadOnly => RowAccess::ReadOnly,
        Access::WriteOnly => RowAccess::WriteOnly,
        Access::ReadWrite | Access::ReadWriteInput | Access::ReadWriteOutput => RowAccess::ReadWrite,
    }
}

/// The type of a row. A text has the space of its default, and some more.
fn kind(data_type: DataType, value: Option<&[u8]>) -> Option<Type> {
    let len = value.map_or(0, <[u8]>::len);
    let size = |least: usize| u8::try_from(len.max(least)).unwrap_or(LONGEST).min(LONGEST);
    Some(match data_type.0 {
        0x01 => Type::Boolean,
        0x02 => Type::Integer8,
        0x03 => Type::Integer16,
        0x04 => Type::Integer32,
        0x05 => Type::Unsigned8,
        0x06 => Type::Unsigned16,
        0x07 => Type::Unsigned32,
        0x08 => Type::Real32,
        0x09 => Type::VisibleString(size(TEXT)),
        0x0A | 0x0B => Type::OctetString(size(1)),
        0x0C => Type::TimeOfDay,
        0x0D => Type::TimeDifference,
        0x0F => Type::Domain,
        0x10 => Type::Integer24,
        0x11 => Type::Real64,
        0x12 => Type::Integer40,
        0x13 => Type::Integer48,
        0x14 => Type::Integer56,
        0x15 => Type::Integer64,
        0x16 => Type::Unsigned24,
        0x18 => Type::Unsigned40,
        0x19 => Type::Unsigned48,
        0x1A => Type::Unsigned56,
        0x1B => Type::Unsigned64,
        _ => return None,
    })
}

/// Whether a row cannot have a value as its default: bytes, and the upper half of UNSIGNED64.
fn has_no_default(kind: Type, value: &[u8]) -> bool {
    let is_large = kind == Type::Unsigned64 && value.last().is_some_and(|highest| *highest & 0x80 != 0);
    is_large || matches!(kind, Type::OctetString(_))
}

/// The bytes of a value.
fn bytes(formula: &Formula, data_type: DataType, node: NodeId) -> Option<Vec<u8>> {
    let value = match formula.evaluate(node) {
        eds::Value::Text(text) => Value::parse(&text, data_type).ok()?,
        eds::Value::Integer(value) => Value::Integer(value),
        eds::Value::Real(value) => Value::Real64(value),
    };
    Some(value.encode(data_type))
}

/// The default of a row; `usual` where the data sheet has none that the row can have.
fn default(formula: Option<&Formula>, kind: Type, node: NodeId, usual: DefaultValue) -> DefaultValue {
    let Some(formula) = formula else { return usual };
    if let (Formula::NodeId(base), Type::Unsigned32) = (formula, kind) {
        return u32::try_from(*base).map_or(usual, DefaultValue::NodeId);
    }
    match (formula.evaluate(node), kind.range()) {
        (eds::Value::Integer(value), Some((low, high))) => {
            let value = value.clamp(low.into(), high.into());
            DefaultValue::Integer(i64::try_from(value).unwrap_or(high))
        }
        #[allow(clippy::cast_possible_truncation)] // The nearest number of the type.
        (eds::Value::Real(value), _) if kind == Type::Real32 && (value as f32).is_finite() => {
            DefaultValue::Real(value as f32)
        }
        (eds::Value::Real(value), _) if kind == Type::Real64 => {
            DefaultValue::Integer(value.to_bits().cast_signed())
        }
        (eds::Value::Text(text), _) if matches!(kind, Type::VisibleString(_)) => {
            let ascii = text.chars().filter(char::is_ascii).take(LONGEST.into());
            DefaultValue::Text(ascii.collect::<String>().leak())
        }
        _ => usual,
    }
}

/// The limits of an entry, where they are narrower than the type. A limit of a larger type is ignored.
fn limits(entry: &Entry, kind: Type, node: NodeId) -> Option<(i64, i64)> {
    let (min, max) = kind.range().filter(|_| kind.size() <= 4)?;
    let limit = |formula: &Option<Formula>, otherwise: i64| match formula.as_ref()?.evaluate(node) {
        eds::Value::Integer(value) => i64::try_from(value).ok(),
        _ => Some(otherwise),
    };
    let low = limit(&entry.low, min).unwrap_or(min).max(min);
    let high = limit(&entry.high, max).unwrap_or(max).min(max);
    Some((low, high)).filter(|limits| low <= high && *limits != (min, max))
}

fn is_within(default: DefaultValue, (low, high): (i64, i64)) -> bool {
    match default {
        DefaultValue::Integer(value) => (low..=high).contains(&value),
        // The value depends on the node-ID.
        _ => false,
    }
}

fn mapping(entry: &Entry, row: &Object) -> Mapping {
    let fits = (1..=8).contains(&row.kind.size());
    let is_sent =
        fits && entry.is_tpdo_mappable() && !matches!(row.rule(), Rule::ErrorCount | Rule::ErrorEntry);
    let is_received = fits && entry.is_rpdo_mappable() && matches!(row.rule(), Rule::Plain);
    match (is_sent, is_received) {
        (true, true) => Mapping::Both,
        (true, false) => Mapping::Tpdo,
        (false, true) => Mapping::Rpdo,
        (false, false) => Mapping::No,
    }
}

/// Whether the device stores a value with 1010h: a parameter, no process value and no command.
fn is_stored(entry: &Entry, row: &Object) -> bool {
    let is_command = row.rule().is_command() || matches!(row.rule(), Rule::ErrorCount | Rule::ErrorEntry);
    let has_value = !matches!(entry.data_type.class(), Class::Bytes | Class::Text);
    row.access == RowAccess::ReadWrite && has_value && !is_command && !entry.is_rpdo_mappable()
}

fn group(index: u16) -> Group {
    if index < 0x2000 { Group::Communication } else { Group::Application }
}
