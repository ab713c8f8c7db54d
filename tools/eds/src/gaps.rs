//! Missing parts of a data sheet: what its lists and its counts tell and no section has, as in a truncated file.

use std::collections::BTreeMap;

use crate::ini::{Ini, Section};
use crate::read::FIRST_OBJECT;
use crate::value::number;
use crate::{Object, Problem};

/// The lists of objects (CiA 306).
const LISTS: [&str; 3] = ["mandatoryobjects", "optionalobjects", "manufacturerobjects"];

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
