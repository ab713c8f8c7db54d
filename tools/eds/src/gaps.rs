//! Missing parts of a data sheet: what its lists and its counts tell and no section has, as in a truncated file.

use std::collections::BTreeMap;

use crate::ini::{Ini, Section};
use crate::read::{FIRST_OBJECT, address};
use crate::value::number;
use crate::{Object, Problem};

/// The lists of objects (CiA 306).
const LISTS: [&str; 3] = ["mandatoryobjects", "optionalobjects", "manufacturerobjects"];

/// The keys of an object that a vendor writes for all objects of a kind or for none. A record has a number instead of a type.
const KEYS: [&[&str]; 6] = [
    &["ParameterName"],
    &["ObjectType"],
    &["SubNumber", "DataType"],
    &["AccessType"],
    &["PDOMapping"],
    &["ParameterValue"],
];
/// The least number of sections from which the keys of a kind are known.
const KIND: usize = 3;

/// Warns of each missing part. A file without any list is one of a vendor that writes none.
pub(crate) fn warn(ini: &Ini, objects: &BTreeMap<u16, Object>) {
    let whole = |list: &Section| list.get("SupportedObjects").is_some();
    let lists = LISTS.map(|name| (name, ini.section(name).filter(whole)));
    if lists.iter().any(|(_, list)| list.is_some()) {
        for (name, list) in lists {
            match list {
                Some(list) => warn_of_list(list, objects),
                None => ini.warn_of(name, Problem::NoList),
            }
        }
    }
    for (index, object) in objects {
        if let Some(section) = ini.section(&format!("{index:04x}")) {
            warn_of_subs(section, object);
        }
    }
    if let Some(line) = ini.broken_line() {
        ini.warn_of("", Problem::BrokenLine(line.into()));
    }
    if let Some(last) = ini.last_section().filter(|last| address(last.name()).is_some()) {
        warn_of_end(ini, last);
    }
}

/// Warns of a last section without the keys with which all sections of its kind end.
fn warn_of_end(ini: &Ini, last: Section) {
    let (end, value) = last.keys().last().unwrap_or_default();
    let is_object = |section: &Section| section.name() != last.name() && address(section.name()).is_some();
    // The value at the end may be cut off, too.
    let is_alike = |section: &Section| match (last.get("ObjectType"), section.get("ObjectType")) {
        (None, _) => true,
        (Some(_), Some(text)) if end == "objecttype" => text.starts_with(value),
        (wanted, text) => wanted == text,
    };
    let kind: Vec<Section> = ini.sections().filter(is_object).filter(is_alike).collect();
    let is_later = |section: &Section, names: &[&str]| {
        let keys: Vec<&str> = section.keys().map(|(key, _)| key).collect();
        let begin = keys.iter().rposition(|key| last.get(key).is_some()).map_or(0, |place| place + 1);
        keys[begin..].iter().any(|key| names.iter().any(|name| key.eq_ignore_ascii_case(name)))
    };
    let is_missing = |names: &&&[&str]| {
        names.iter().all(|name| last.get(name).is_none())
            && kind.iter().all(|section| is_later(section, names))
    };
    let missing = KEYS.iter().find(is_missing).filter(|_| kind.len() >= KIND);
    if let Some(names) = missing {
        last.warn("", Problem::NoEnd(names.join(" or ")));
    }
}

fn warn_of_list(list: Section, objects: &BTreeMap<u16, Object>) {
    let listed: Vec<u16> = list.keys().filter_map(listed).collect();
    warn_of_count(list, "SupportedObjects", listed.len());
    let is_missing = |index: &u16| *index >= FIRST_OBJECT && !objects.contains_key(index);
    let mut missing = listed.into_iter().filter(is_missing);
    if let Some(first) = missing.next() {
        list.warn("", Problem::NoObject { first, more: missing.count() });
    }
}

/// The index in a line of a list, `3=0x1018`.
fn listed((key, text): (&str, &str)) -> Option<u16> {
    key.parse::<u16>().ok()?;
    number(text)?.try_into().ok()
}

fn warn_of_subs(section: Section, object: &Object) {
    if object.object_type.has_subs() && section.get("CompactSubObj").is_none() {
        warn_of_count(section, "SubNumber", object.entries.len());
    }
}

fn warn_of_count(section: Section, key: &'static str, found: usize) {
    let counted = usize::from(section.number::<u16>(key));
    if counted > found {
        section.warn(key, Problem::Fewer { counted, found });
    }
}
