//! Every row of the table of CiA 406 against the encoder's own table, both ways. The first is written from the document, the
//! second is what the node is made of. The column `classes` is what the profile asks of classes C1 and C2: mandatory, optional,
//! or conditional; a class C2 encoder with everything optional has every row.

use std::collections::BTreeMap;

use canopen::dictionary::{Access, DefaultValue, Mapping, Object, Type};
use node::encoder::OBJECTS;

const TABLE: &str = include_str!("../tables/cia406.csv");

/// What both tables say about an entry: name, type, access, mapping.
type Facts = (String, String, &'static str, &'static str);

#[derive(Debug)]
struct Row {
    key: (u16, u8),
    facts: Facts,
    default: &'static str,
}

fn rows() -> impl Iterator<Item = Row> {
    TABLE.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let &[index, sub, name, kind, access, default, mapping, _classes] = &cells[..] else {
            panic!("{line}")
        };
        let index = u16::from_str_radix(index.trim_start_matches("0x"), 16).unwrap();
        let facts = (name.into(), kind.into(), access, mapping);
        Row { key: (index, sub.parse().unwrap()), facts, default }
    })
}

/// The objects of the profile; those of the manufacturer are in no document.
fn own() -> BTreeMap<(u16, u8), &'static Object> {
    let profile = OBJECTS.iter().filter(|own| own.index >= 0x6000);
    profile.map(|own| ((own.index, own.sub), own)).collect()
}

fn facts(own: &Object) -> Facts {
    let kind = match own.kind {
        Type::VisibleString(_) => "VISIBLE_STRING".into(),
        kind => format!("{kind:?}").to_uppercase(),
    };
    let access = match own.access {
        Access::Const => "const",
        Access::ReadOnly => "ro",
        Access::WriteOnly => "wo",
        Access::ReadWrite => "rw",
    };
    let mapping = match own.mapping {
        Mapping::No => "no",
        Mapping::Tpdo => "tpdo",
        Mapping::Rpdo => "rpdo",
    };
    (own.name.into(), kind, access, mapping)
}

fn integer(text: &str) -> i64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    match digits.strip_prefix("0x") {
        Some(digits) => sign * i64::from_str_radix(digits, 16).unwrap(),
        None => sign * digits.parse::<i64>().unwrap(),
    }
}

#[test]
fn both_tables_have_the_same_entries_with_the_same_attributes() {
    let table: BTreeMap<_, _> = rows().map(|row| (row.key, row.facts)).collect();
    let own: BTreeMap<_, _> = own().into_iter().map(|(key, own)| (key, facts(own))).collect();
    for (key, facts) in &table {
        assert_eq!(own.get(key), Some(facts), "{key:X?} of the document");
    }
    assert_eq!(table, own, "the encoder has more than the document");
    assert_eq!(table.len(), rows().count(), "an entry is there twice");
}

#[test]
fn defaults_are_those_of_the_table() {
    let own = own();
    for row in rows().filter(|row| !matches!(row.default, "$MEASURED" | "$SERIAL")) {
        let default = own.get(&row.key).unwrap().default;
        assert_eq!(default, DefaultValue::Integer(integer(row.default)), "{row:X?}");
    }
}
