//! The dictionary of the device against its data sheet.

use eds::{Class, Entry, Value};

use super::super::prelude::*;
use super::super::subject::size;
use crate::value;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "DIC-01",
        "Every declared communication entry is readable, with its size",
        "CiA 301, 7.4.7",
        sizes::<0x1000>,
    ),
    Check::new(
        "DIC-02",
        "Every declared application entry is readable, with its size",
        "CiA 301, 7.4.7",
        sizes::<0x2000>,
    ),
    Check::new(
        "DIC-03",
        "Communication parameters start with their defaults",
        "CiA 306, 4.6.3",
        defaults::<0x1000>,
    )
    .stores(),
    Check::new(
        "DIC-04",
        "Application parameters start with their defaults",
        "CiA 306, 4.6.3",
        defaults::<0x2000>,
    )
    .stores(),
    Check::new("DIC-05", "Every read-only entry refuses a write", "CiA 301, 7.4.5", read_only),
    Check::new("DIC-06", "Every write-only entry refuses to be read", "CiA 301, 7.4.5", write_only),
    Check::new("DIC-07", "Upper limits are enforced", "CiA 306, 4.6.3; CiA 301, table 22", upper),
    Check::new("DIC-08", "Lower limits are enforced", "CiA 306, 4.6.3; CiA 301, table 22", lower),
    Check::new("DIC-09", "Every parameter takes its own value back", "CiA 301, 7.4.5", own_values),
    Check::new(
        "DIC-10",
        "Constants and declared fixed values are those of the data sheet",
        "CiA 306, 4.6.3",
        constants,
    ),
    Check::new("DIC-11", "Sub-index 0 tells the highest sub-index", "CiA 301, 7.4.4", highest),
    Check::new("DIC-12", "No sub-index answers beyond the highest", "CiA 301, 7.4.4", beyond),
    Check::new(
        "DIC-13",
        "The device has no communication object that the data sheet lacks",
        "CiA 306, 4.6.3",
        undeclared,
    ),
    Check::new(
        "DIC-14",
        "Sub-index FFh, where it exists, tells type and object code",
        "CiA 301, 7.4.4.2",
        structure,
    ),
    Check::new(
        "DIC-15",
        "The low word of 1000h is 0 or the number of a profile",
        "CiA 301, 7.5.2.1",
        device_type,
    )
    .recommended(),
    Check::new("DIC-16", "1018h:1 can be read", "CiA 301, 7.5.2.19", identity),
];

/// Abort codes of an object that has no value yet, or none in the current state.
const NOTHING_YET: [u32; 3] = [abort::NO_DATA, abort::STATE, abort::ACCESS];

/// Runs `complain` for each entry. All complaints together are one deviation.
fn each(
    s: &mut Subject<'_>,
    entries: &[Entry],
    expected: &str,
    mut complain: impl FnMut(&mut Subject<'_>, &Entry) -> Outcome<Option<String>>,
) -> Outcome {
    let mut wrong = Vec::new();
    for entry in entries {
        if let Some(complaint) = complain(s, entry)? {
            wrong.push(format!("{:04X}h:{}: {complaint}", entry.index, entry.sub));
        }
    }
    if entries.is_empty() {
        return Err(skip("the data sheet has no such entry"));
    }
    ensure(wrong.is_empty(), expected, wrong.join("; "))
}

/// Whether an entry is in the same part of the dictionary as `first`: the communication profile or the rest.
const fn is_of(first: u16, index: u16) -> bool {
    (first < 0x2000) == (index < 0x2000)
}

fn sizes<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let entries =
        s.entries(|entry| is_of(FIRST, entry.index) && entry.access.is_readable() && entry.index >= 0x1000)?;
    each(s, &entries, "a value of the declared size", |s, entry| {
        Ok(match s.try_read(entry.index, entry.sub)? {
            Err(Refusal(code)) if NOTHING_YET.contains(&code) && may_be_empty(entry) => None,
            Err(refusal) => Some(refusal.to_string()),
            Ok(bytes) => size(entry)
                .filter(|size| *size != bytes.len())
                .map(|size| format!("{} bytes, not {size}", bytes.len())),
        })
    })
}

/// Whether an object may be empty: a list of errors, a domain, a program.
fn may_be_empty(entry: &Entry) -> bool {
    matches!(entry.index, 0x1003 | 0x1F50..=0x1F5F)
        || entry.data_type == eds::DataType::DOMAIN
        || size(entry).is_none()
}

/// The default of the data sheet as bytes; `None` where it is not a number.
fn declared(s: &Subject<'_>, entry: &Entry) -> Option<Vec<u8>> {
    let value = match (entry.default.as_ref()?.evaluate(s.node()), entry.data_type.class()) {
        (Value::Integer(number), _) => value::Value::Integer(number),
        #[allow(clippy::cast_possible_truncation)] // The number was a REAL32 in the file.
        (Value::Real(number), Class::Real(32)) => value::Value::Real32(number as f32),
        (Value::Real(number), _) => value::Value::Real64(number),
        (Value::Text(text), Class::Text) if !text.is_empty() => value::Value::Text(text),
        _ => return None,
    };
    Some(value.encode(entry.data_type))
}

fn defaults<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let entries =
        s.entries(|entry| is_of(FIRST, entry.index) && crate::configuration::is_parameter(entry))?;
    let entries: Vec<Entry> = entries.into_iter().filter(|entry| declared(s, entry).is_some()).collect();
    s.with_defaults(|s| {
        each(s, &entries, "the defaults of the data sheet", |s, entry| {
            let (expected, seen) = (declared(s, entry), s.try_read(entry.index, entry.sub)?);
            Ok(seen
                .ok()
                .filter(|seen| Some(seen) != expected.as_ref())
                .map(|seen| format!("{seen:02X?}, not {:02X?}", expected.unwrap_or_default())))
        })
    })
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| {
        entry.index >= 0x1000 && !entry.access.is_writable() && size(entry).is_some_and(|size| size <= 4)
    })?;
    each(s, &entries, "abort 0601 0002h for a write", |s, entry| {
        let zeros = vec![0; size(entry).unwrap_or(1)];
        Ok(match s.try_write(entry.index, entry.sub, &zeros)? {
            Err(Refusal(abort::READ_ONLY)) => None,
            Err(refusal) => Some(refusal.to_string()),
            Ok(()) => Some("the write was taken".to_owned()),
        })
    })
}

fn write_only(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| !entry.access.is_readable())?;
    each(s, &entries, "abort 0601 0001h for an upload", |s, entry| {
        Ok(match s.try_read(entry.index, entry.sub)? {
            Err(Refusal(abort::WRITE_ONLY)) => None,
            Err(refusal) => Some(refusal.to_string()),
            Ok(bytes) => Some(format!("the value {bytes:02X?}")),
        })
    })
}

/// The parameters whose limit is narrower than their type, with the first value beyond the limit.
fn beyond_limits(s: &Subject<'_>, is_upper: bool) -> Outcome<Vec<(Entry, Vec<u8>)>> {
    let entries = s.entries(crate::configuration::is_parameter)?;
    let beyond = |entry: Entry| {
        let limit = if is_upper { entry.high.as_ref() } else { entry.low.as_ref() };
        let Value::Integer(limit) = limit?.evaluate(s.node()) else { return None };
        let value = if is_upper { limit + 1 } else { limit - 1 };
        let (low, high) = match entry.data_type.class() {
            Class::Signed(bits) => (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1),
            Class::Unsigned(bits) if bits > 1 => (0, (1_i128 << bits) - 1),
            _ => return None,
        };
        let bytes = value::Value::Integer(value).encode(entry.data_type);
        (low..=high).contains(&value).then_some((entry, bytes))
    };
    Ok(entries.into_iter().filter_map(beyond).collect())
}

fn limits(s: &mut Subject<'_>, is_upper: bool, codes: &[u32]) -> Outcome {
    let values = beyond_limits(s, is_upper)?;
    let entries: Vec<Entry> = values.iter().map(|(entry, _)| entry.clone()).collect();
    let mut values = values.iter();
    each(s, &entries, "an abort that tells the limit", |s, entry| {
        let bytes = values.next().map(|(_, bytes)| bytes.clone()).unwrap_or_default();
        Ok(match s.change(entry.index, entry.sub, &bytes)? {
            Err(Refusal(code)) if codes.contains(&code) => None,
            Err(refusal) => Some(refusal.to_string()),
            Ok(()) => Some(format!("{bytes:02X?} was taken")),
        })
    })
}

fn upper(s: &mut Subject<'_>) -> Outcome {
    limits(s, true, &[abort::TOO_HIGH, abort::VALUE, abort::PARAMETER, abort::STATE, abort::ACCESS])
}

fn lower(s: &mut Subject<'_>) -> Outcome {
    limits(s, false, &[abort::TOO_LOW, abort::VALUE, abort::PARAMETER, abort::STATE, abort::ACCESS])
}

/// Whether the value may be locked: the object of a PDO in use, or of a running SYNC.
const fn is_locked(index: u16) -> bool {
    matches!(index, 0x1400..=0x1BFF | 0x1019 | 0x1FA0..=0x1FCF)
}

fn own_values(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| crate::configuration::is_parameter(entry) && !is_locked(entry.index))?;
    each(s, &entries, "the value that was read is taken back", |s, entry| {
        let Ok(value) = s.try_read(entry.index, entry.sub)? else { return Ok(None) };
        Ok(match s.try_write(entry.index, entry.sub, &value)? {
            Ok(()) | Err(Refusal(abort::STATE)) => None,
            // A manufacturer's object may be locked, or be a command that needs a signature.
            Err(Refusal(abort::NOT_STORED | abort::ACCESS)) if matches!(entry.index, 0x2000..=0x5FFF) => None,
            Err(refusal) => Some(format!("{value:02X?}: {refusal}")),
        })
    })
}

fn constants(s: &mut Subject<'_>) -> Outcome {
    let is_fixed = |entry: &Entry| {
        let identity = matches!(entry.index, 0x1000 | 0x1008..=0x100A | 0x1018);
        entry.index >= 0x1000
            && (entry.access == eds::Access::Const || identity && !entry.access.is_writable())
    };
    let entries = s.entries(is_fixed)?;
    let entries: Vec<Entry> = entries.into_iter().filter(|entry| declared(s, entry).is_some()).collect();
    each(s, &entries, "the value of the data sheet", |s, entry| {
        let (expected, seen) = (declared(s, entry).unwrap_or_default(), s.try_read(entry.index, entry.sub)?);
        Ok(match seen {
            // The device may pad a text with zeros.
            Ok(seen)
                if seen == expected
                    || size(entry).is_none() && value::text(&seen) == value::text(&expected) =>
            {
                None
            }
            Ok(seen) => Some(format!("{seen:02X?}, not {expected:02X?}")),
            Err(refusal) => Some(refusal.to_string()),
        })
    })
}

/// The objects with sub-indices, and the highest sub-index in the data sheet.
fn holders(s: &Subject<'_>) -> Outcome<Vec<(Entry, u8)>> {
    let sheet = s.sheet()?;
    let holders =
        sheet.objects.values().filter(|object| object.object_type.has_subs() && object.index >= 0x1000);
    let highest = |object: &eds::Object| object.entries.keys().copied().filter(|sub| *sub < 0xFF).max();
    Ok(holders.filter_map(|object| Some((object.entries.get(&0)?.clone(), highest(object)?))).collect())
}

/// Whether sub-index 0 of an object counts entries in use: errors, mapped objects, scanner lines.
const fn counts_use(index: u16) -> bool {
    matches!(index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF | 0x1FA0..=0x1FFF)
}

fn highest(s: &mut Subject<'_>) -> Outcome {
    let holders: Vec<(Entry, u8)> = holders(s)?
        .into_iter()
        .filter(|(entry, _)| !counts_use(entry.index) && !entry.access.is_writable())
        .collect();
    let entries: Vec<Entry> = holders.iter().map(|(entry, _)| entry.clone()).collect();
    let mut highest = holders.iter().map(|(_, highest)| *highest);
    each(s, &entries, "the highest sub-index", |s, entry| {
        let highest = highest.next().unwrap_or(0);
        // A profile may let sub-index 0 count the entries in use. Then the data sheet has another default.
        let counts = declared(s, entry).is_some_and(|default| default != [highest]);
        let seen = s.number(entry.index, 0)?;
        let is_good = seen == u32::from(highest) || counts && seen < u32::from(highest);
        Ok((!is_good).then(|| format!("{seen}, and the data sheet has {highest}")))
    })
}

fn beyond(s: &mut Subject<'_>) -> Outcome {
    let holders = holders(s)?;
    let entries: Vec<Entry> = holders.iter().map(|(entry, _)| entry.clone()).collect();
    let mut highest = holders.iter().map(|(_, highest)| *highest);
    each(s, &entries, "abort 0609 0011h beyond the highest sub-index", |s, entry| {
        let sub = highest.next().unwrap_or(0).saturating_add(1);
        Ok(match s.try_read(entry.index, sub)? {
            Err(Refusal(abort::NO_SUB_INDEX)) => None,
            _ if sub == 0xFF => None,
            Err(refusal) => Some(format!("sub-index {sub}: {refusal}")),
            Ok(_) => Some(format!("sub-index {sub} can be read")),
        })
    })
}

/// The communication objects that CiA 301 knows by one index each.
const COMMUNICATION: [u16; 26] = [
    0x1000, 0x1001, 0x1002, 0x1003, 0x1005, 0x1006, 0x1007, 0x1008, 0x1009, 0x100A, 0x100C, 0x100D, 0x1010,
    0x1011, 0x1012, 0x1013, 0x1014, 0x1015, 0x1016, 0x1017, 0x1018, 0x1019, 0x1020, 0x1021, 0x1028, 0x1029,
];

fn undeclared(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let mut wrong = Vec::new();
    for index in COMMUNICATION.into_iter().filter(|index| !sheet.objects.contains_key(index)) {
        if s.try_read(index, 0)?.is_ok() {
            wrong.push(format!("{index:04X}h"));
        }
    }
    ensure(wrong.is_empty(), "only declared objects", format!("also {}", wrong.join(", ")))
}

fn structure(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let mut found = 0;
    for object in
        sheet.objects.values().filter(|object| object.index >= 0x1000 && object.object_type.has_subs())
    {
        let Ok(bytes) = s.try_read(object.index, 0xFF)? else { continue };
        let expected = [object.object_type.code()];
        let seen = bytes.first().copied().into_iter().collect::<Vec<u8>>();
        found += 1;
        let place = format!("object code {:02X}h in {:04X}h:FFh, of four bytes", expected[0], object.index);
        ensure(seen == expected && bytes.len() == 4, place, format!("{bytes:02X?}"))?;
    }
    if found == 0 { Err(skip("no object has a sub-index FFh")) } else { Ok(()) }
}

fn device_type(s: &mut Subject<'_>) -> Outcome {
    let value = s.number(0x1000, 0)?;
    let profile = value & 0xFFFF;
    let is_one = profile == 0 || (201..=999).contains(&profile) || profile == 0xFFFF;
    ensure(is_one, "0, or the number of a device profile", format!("{profile}"))
}

fn identity(s: &mut Subject<'_>) -> Outcome {
    s.number(0x1018, 1).map(drop)
}
