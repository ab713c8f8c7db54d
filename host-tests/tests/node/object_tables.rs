//! Every row of the tables compared with the running node of each personality, by SDO. The tables are written from the
//! documents, not derived from the node's own tables.

use std::collections::BTreeSet;

use canopen::dictionary::{Access, Type};
use host_tests::bench::{Bench, ID};
use host_tests::lift417;
use host_tests::tables::{Row, table};
use node::Personality;

const NOT_MAPPABLE: u32 = 0x0604_0041;
const WRITE_ONLY: u32 = 0x0601_0001;
const READ_ONLY: u32 = 0x0601_0002;
const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;
const DEVICE_STATE: u32 = 0x0800_0022;
const NO_DATA: u32 = 0x0800_0024;

/// Every row of every personality.
fn rows() -> impl Iterator<Item = (Personality, Row)> {
    let of = |personality| table(personality).into_iter().map(move |row| (personality, row));
    Personality::ALL.into_iter().flat_map(of)
}

/// A node with writable PDO objects: steps 1 and 2 of the mapping procedure are done.
fn without_tpdos(personality: Personality) -> Bench {
    let mut bench = Bench::booted_as(personality);
    match personality {
        Personality::Lift => {
            let own = lift417::pdos().filter(|pdo| pdo.is_produced && pdo.is_of_the_node());
            own.for_each(|pdo| bench.switch_tpdo_off(pdo.number - 1));
        }
        _ => (0..4).for_each(|number| bench.disable_tpdo(number)),
    }
    bench
}

#[test]
fn the_node_has_nothing_that_the_tables_do_not_know() {
    let mut differences = Vec::new();
    for personality in Personality::ALL {
        let known = table(personality).into_iter().map(|row| (row.index, row.sub, row.name));
        let own = personality.rows().iter().map(|row| (row.index, row.sub, row.name));
        let [known, own] = [known.collect::<BTreeSet<_>>(), own.collect()];
        differences.extend(known.symmetric_difference(&own).map(|row| (personality, *row)));
    }
    assert!(differences.is_empty(), "{differences:X?}");
}

#[test]
fn reading_gives_the_default_in_the_size_of_the_type() {
    for (personality, row) in rows() {
        let result = Bench::booted_as(personality).read(row.index, row.sub);
        let expected = match (row.access, row.index) {
            ("wo", _) => Err(WRITE_ONLY),
            (_, 0x1003) if row.sub > 0 => Err(NO_DATA),
            // No value has been written yet.
            (_, 0x2F00) => Err(NO_DATA),
            // No event: zeros.
            (_, 0x2006) => Ok(vec![0; update::Log::LEN]),
            // The state of the memory.
            (_, 0x2010) if row.sub > 0 => {
                assert_eq!(result.map(|value| value.len()), Ok(row.size().unwrap()), "{row:X?}");
                continue;
            }
            _ => Ok(row.default(personality).unwrap_or_else(|| vec![0; row.size().unwrap()])),
        };
        assert_eq!(result, expected, "{personality:?} {row:X?}");
    }
}

#[test]
fn writing_is_refused_or_taken_as_the_access_says() {
    for (personality, row) in rows() {
        let mut bench = without_tpdos(personality);
        let size = row.size().unwrap_or(4);
        if !row.is_writable() {
            let refused = bench.write(row.index, row.sub, &[0; 8][..size]);
            assert_eq!(refused, Err(READ_ONLY), "{personality:?} {row:X?}");
            continue;
        }
        let value = match row.index {
            0x6125 | 0x6925 => b"zero".to_vec(),
            0x6139 | 0x6939 => b"tare".to_vec(),
            0x1010 | 0x2204 => b"save".to_vec(),
            0x1011 => b"load".to_vec(),
            0x2002 if row.sub == 2 => b"back".to_vec(),
            0x2F00 => vec![1, 2, 3],
            _ if row.access == "wo" => vec![0; size],
            _ => bench.read(row.index, row.sub).unwrap(),
        };
        let expected = match (row.index, row.sub) {
            // Factory data are locked.
            (0x2107, _) => Err(DEVICE_STATE),
            // The calibration is locked until the key is written.
            (0x2200..=0x2202, _) => Err(DEVICE_STATE),
            // There is no second encoder.
            (0x6010, 2) => Err(DEVICE_STATE),
            // No value has been measured yet.
            (0x6382 | 0x6125 | 0x6925 | 0x6139 | 0x6939, _) => Err(DEVICE_STATE),
            // The program is not on trial.
            (0x2002, 2) => Err(DEVICE_STATE),
            // The bootloader has no key, so no response can be valid.
            (0x2003, 3) => Err(DEVICE_STATE),
            _ => Ok(()),
        };
        assert_eq!(bench.write(row.index, row.sub, &value), expected, "{personality:?} {row:X?}");
    }
}

#[test]
fn a_value_of_the_wrong_length_is_refused() {
    for (personality, row) in rows().filter(|(_, row)| row.is_writable()) {
        let mut bench = Bench::booted_as(personality);
        let Some(size) = row.size() else { continue };
        if size < 4 {
            let refused = bench.write(row.index, row.sub, &[0; 4][..=size]);
            assert_eq!(refused, Err(TOO_LONG), "{personality:?} {row:X?}");
        }
        if size > 1 {
            let refused = bench.write(row.index, row.sub, &[0; 8][..size - 1]);
            assert_eq!(refused, Err(TOO_SHORT), "{personality:?} {row:X?}");
        }
    }
}

#[test]
fn mappable_objects_are_sent_and_all_others_are_refused() {
    // The profile fixes the mapping of a lift device.
    for (personality, row) in rows().filter(|(personality, _)| *personality != Personality::Lift) {
        let mut bench = without_tpdos(personality);
        let mapped = bench.write(0x1A01, 1, &row.mapping_entry());
        if row.mapping == "no" {
            assert_eq!(mapped, Err(NOT_MAPPABLE), "{personality:?} {row:X?}");
            continue;
        }
        assert_eq!(mapped, Ok(()), "{personality:?} {row:X?}");
        let id = 0x280 + u16::from(ID);
        bench.write(0x1A01, 0, &[1]).unwrap();
        bench.write(0x1801, 2, &[255]).unwrap();
        bench.write(0x1801, 1, &u32::from(id).to_le_bytes()).unwrap();
        bench.nmt(1);
        let value = bench.read(row.index, row.sub).unwrap();
        assert!(bench.take().contains(&(id, value)), "{personality:?} {row:X?}");
    }
}

#[test]
fn the_node_s_table_has_the_access_and_the_type_of_the_row() {
    for (personality, row) in rows() {
        let mut own = personality.rows().iter();
        let own = own.find(|own| (own.index, own.sub) == (row.index, row.sub)).unwrap();
        let access = match own.access {
            Access::Const => "const",
            Access::ReadOnly => "ro",
            Access::WriteOnly => "wo",
            Access::ReadWrite => "rw",
        };
        let kind = match own.kind {
            Type::VisibleString(_) => "VISIBLE_STRING".into(),
            kind => format!("{kind:?}").to_uppercase(),
        };
        assert_eq!((access, kind.as_str()), (row.access, row.kind), "{personality:?} {row:X?}");
    }
}
