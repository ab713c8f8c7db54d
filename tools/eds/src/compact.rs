//! Compact storage: an array whose sub-indices are all alike and written once (CiA 306, `CompactSubObj`).

use std::collections::BTreeMap;

use crate::ini::{Ini, Section};
use crate::read::value;
use crate::{Access, DataType, Entry, Flags, Formula, Value};

/// The entries of an object that has `count` of them, each like `pattern`. Sections `[1003Name]` and `[1003Value]` hold
/// the names and defaults of the entries that differ.
pub(crate) fn entries(ini: &Ini, pattern: &Entry, count: u8) -> BTreeMap<u8, Entry> {
    let mut entries = BTreeMap::from([(0, number_of_entries(pattern.index, count))]);
    entries.extend((1..=count).map(|sub| (sub, like(pattern, sub))));
    for (sub, name) in lines(section(ini, pattern.index, "name")) {
        if let Some(entry) = entries.get_mut(&sub) {
            entry.name = name.into();
        }
    }
    let values = section(ini, pattern.index, "value");
    for (sub, text) in lines(values) {
        if let (Some(entry), Some(section)) = (entries.get_mut(&sub), values) {
            entry.default = value(section, "", text, entry.data_type);
        }
    }
    entries
}

fn section<'a>(ini: &'a Ini, index: u16, name: &str) -> Option<Section<'a>> {
    ini.section(&format!("{index:04x}{name}"))
}

/// The numbered lines of a section.
fn lines(section: Option<Section<'_>>) -> impl Iterator<Item = (u8, &str)> {
    section.into_iter().flat_map(Section::keys).filter_map(|(key, text)| Some((key.parse().ok()?, text)))
}

fn like(pattern: &Entry, sub: u8) -> Entry {
    Entry { sub, name: format!("{}{sub}", pattern.name), ..pattern.clone() }
}

/// The implicit sub-index 0.
fn number_of_entries(index: u16, count: u8) -> Entry {
    Entry {
        index,
        sub: 0,
        name: "NrOfObjects".into(),
        data_type: DataType::UNSIGNED8,
        access: Access::ReadOnly,
        default: Some(Formula::Constant(Value::Integer(count.into()))),
        value: None,
        low: None,
        high: None,
        mappable: false,
        flags: Some(Flags::default()),
        unit: String::new(),
    }
}
