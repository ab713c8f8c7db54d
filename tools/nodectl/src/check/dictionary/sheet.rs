//! Checks of the data sheet alone (CiA 306).

use eds::{Access, DataType, Entry, ObjectType, Value};

use super::super::prelude::*;
use super::super::subject::size;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "EDS-01",
        "The data sheet has the mandatory objects",
        "CiA 301, 7.5.1; CiA 306, 4.6.3",
        mandatory,
    ),
    Check::new(
        "EDS-02",
        "Arrays and records have a sub-index 0 of the type UNSIGNED8",
        "CiA 301, 7.4.4",
        counted,
    ),
    Check::new("EDS-03", "Defaults are within their limits", "CiA 306, 4.6.3", defaults),
    Check::new("EDS-04", "No lower limit is above its upper limit", "CiA 306, 4.6.3", limits),
    Check::new("EDS-05", "Communication objects have the type of CiA 301", "CiA 301, 7.5.2", types),
    Check::new("EDS-06", "Communication objects have the access of CiA 301", "CiA 301, 7.5.2", accesses),
    Check::new("EDS-07", "The numbers of PDOs are those of the objects", "CiA 306, 4.5", pdo_numbers),
    Check::new("EDS-08", "The data sheet names a bit rate", "CiA 306, 4.5", bit_rates),
    Check::new("EDS-09", "Each PDO has its mapping object", "CiA 301, 7.5.2.35 to 7.5.2.38", mappings),
    Check::new("EDS-10", "The vendor-ID of the data sheet is that of the device", "CiA 306, 4.5", vendor),
    Check::new("EDS-11", "The product code of the data sheet is that of the device", "CiA 306, 4.5", product),
    Check::new("EDS-12", "The revision of the data sheet is that of the device", "CiA 306, 4.5", revision)
        .recommended(),
];

fn mandatory(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let missing: Vec<String> = [(0x1000, 0), (0x1001, 0), (0x1018, 0), (0x1018, 1)]
        .into_iter()
        .filter(|&(index, sub)| sheet.get(index, sub).is_none())
        .map(|(index, sub)| format!("{index:04X}h:{sub}"))
        .collect();
    ensure(
        missing.is_empty(),
        "1000h, 1001h and 1018h with its vendor-ID",
        format!("without {}", missing.join(", ")),
    )
}

/// Passes when all entries fulfil a condition; the error names the others.
fn each(entries: &[Entry], expected: &str, holds: impl Fn(&Entry) -> bool) -> Outcome {
    let wrong: Vec<String> = entries
        .iter()
        .filter(|entry| !holds(entry))
        .map(|entry| format!("{:04X}h:{} \"{}\"", entry.index, entry.sub, entry.name))
        .collect();
    ensure(wrong.is_empty(), expected, format!("not so: {}", wrong.join(", ")))
}

fn counted(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let holders = sheet.objects.values().filter(|object| object.object_type != ObjectType::Var);
    let wrong: Vec<String> = holders
        .filter(|object| object.object_type.has_subs())
        .filter(|object| object.entries.get(&0).is_none_or(|entry| entry.data_type != DataType::UNSIGNED8))
        .map(|object| format!("{:04X}h", object.index))
        .collect();
    ensure(wrong.is_empty(), "sub-index 0 as UNSIGNED8", format!("not so: {}", wrong.join(", ")))
}

/// A number of the data sheet, for this node.
fn number(s: &Subject<'_>, formula: Option<&eds::Formula>) -> Option<f64> {
    match formula?.evaluate(s.node()) {
        #[allow(clippy::cast_precision_loss)] // Exact enough to compare limits.
        Value::Integer(value) => Some(value as f64),
        Value::Real(value) => Some(value),
        Value::Text(_) => None,
    }
}

fn defaults(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| entry.default.is_some())?;
    each(&entries, "defaults within their limits", |entry| {
        let value = number(s, entry.default.as_ref());
        let (low, high) = (number(s, entry.low.as_ref()), number(s, entry.high.as_ref()));
        let not_below = value.zip(low).is_none_or(|(value, low)| value >= low);
        not_below && value.zip(high).is_none_or(|(value, high)| value <= high)
    })
}

fn limits(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|_| true)?;
    each(&entries, "the lower limit below the upper one", |entry| {
        let (low, high) = (number(s, entry.low.as_ref()), number(s, entry.high.as_ref()));
        low.zip(high).is_none_or(|(low, high)| low <= high)
    })
}

/// The size of an object of CiA 301 in bytes; `None` where any size is permitted.
const fn standard_size(index: u16, sub: u8) -> Option<usize> {
    match (index, sub) {
        (0x1000 | 0x1002 | 0x1005..=0x1007 | 0x1012 | 0x1014, 0) => Some(4),
        (0x1003 | 0x1010 | 0x1011 | 0x1016 | 0x1018 | 0x1028, 1..) => Some(4),
        (0x1001 | 0x100D | 0x1019 | 0x1003..=0x1030 | 0x1200..=0x1BFF, 0) if !matches!(index, 0x1005..=0x1009 | 0x100A | 0x100C | 0x1012..=0x1015 | 0x1017) => {
            Some(1)
        }
        (0x100C | 0x1015 | 0x1017, 0) => Some(2),
        (0x1029, 1..) => Some(1),
        (0x1200..=0x12FF, 1 | 2) | (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => Some(4),
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, 1..) => Some(4),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 2 | 6) => Some(1),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 3 | 5) => Some(2),
        _ => None,
    }
}

fn types(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| matches!(entry.index, 0x1000..=0x1BFF))?;
    each(&entries, "the sizes of CiA 301", |entry| {
        standard_size(entry.index, entry.sub).is_none_or(|bytes| size(entry) == Some(bytes))
    })
}

fn accesses(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| matches!(entry.index, 0x1000..=0x1029))?;
    each(&entries, "the access of CiA 301", |entry| match (entry.index, entry.sub) {
        (0x1000..=0x1002 | 0x1018, _) | (0x1003, 1..) => !entry.access.is_writable(),
        (0x1008..=0x100A, _) => matches!(entry.access, Access::Const | Access::ReadOnly),
        (0x1010 | 0x1011, 1..) | (0x1003, 0) => entry.access == Access::ReadWrite,
        _ => entry.access.is_readable(),
    })
}

fn pdo_numbers(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let count = |first: u16| sheet.objects.keys().filter(|index| **index & 0xFE00 == first).count();
    let (said, there) =
        ((sheet.device.rpdos.into(), sheet.device.tpdos.into()), (count(0x1400), count(0x1800)));
    let words = |(rpdos, tpdos): (usize, usize)| format!("{rpdos} RPDOs and {tpdos} TPDOs");
    ensure(said == there, words(there), words(said))
}

fn bit_rates(s: &mut Subject<'_>) -> Outcome {
    ensure(!s.sheet()?.device.bit_rates.is_empty(), "a bit rate", "none")
}

fn mappings(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let pdos = sheet.objects.keys().filter(|index| matches!(index, 0x1400..=0x15FF | 0x1800..=0x19FF));
    let wrong: Vec<String> = pdos
        .filter(|index| !sheet.objects.contains_key(&(**index | 0x200)))
        .map(|index| format!("{index:04X}h"))
        .collect();
    ensure(wrong.is_empty(), "a mapping object for each PDO", format!("none for {}", wrong.join(", ")))
}

fn vendor(s: &mut Subject<'_>) -> Outcome {
    let number = s.sheet()?.device.vendor_number;
    s.holds(0x1018, 1, number)
}

fn product(s: &mut Subject<'_>) -> Outcome {
    let number = s.sheet()?.device.product_number;
    s.need(0x1018, 2)?;
    s.holds(0x1018, 2, number)
}

fn revision(s: &mut Subject<'_>) -> Outcome {
    let number = s.sheet()?.device.revision_number;
    s.need(0x1018, 3)?;
    s.holds(0x1018, 3, number)
}
