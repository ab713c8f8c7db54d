//! Every row of two tables against the running node, by SDO: the objects of the pressure transmitter, and what the node
//! has of CiA 301 beyond them. They are written from the documents; the node's own table is another one.

use std::collections::BTreeSet;

use host_tests::bench::{Bench, ID, setup};
use node::pressure::OBJECTS;
use node::{Personality, REVISION, VENDOR_ID};

const TRANSMITTER: &str = include_str!("../tables/cia404.csv");
const COMMUNICATION: &str = include_str!("../tables/cia301.csv");

const NOT_MAPPABLE: u32 = 0x0604_0041;
const WRITE_ONLY: u32 = 0x0601_0001;
const READ_ONLY: u32 = 0x0601_0002;
const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;
const NO_DATA: u32 = 0x0800_0024;

#[derive(Debug)]
struct Row {
    index: u16,
    sub: u8,
    name: &'static str,
    kind: &'static str,
    access: &'static str,
    default: &'static str,
    mapping: &'static str,
}

impl Row {
    fn parse(line: &'static str) -> Row {
        let cells: Vec<&str> = line.split(',').collect();
        let &[index, sub, name, kind, access, default, mapping] = &cells[..] else { panic!("{line}") };
        let index = u16::from_str_radix(index.trim_start_matches("0x"), 16).unwrap();
        Row { index, sub: sub.parse().unwrap(), name, kind, access, default, mapping }
    }

    /// Bytes of a value; `None` for what has any length.
    fn size(&self) -> Option<usize> {
        match self.kind {
            "UNSIGNED8" => Some(1),
            "UNSIGNED16" | "INTEGER16" => Some(2),
            "UNSIGNED32" | "INTEGER32" | "REAL32" => Some(4),
            "UNSIGNED64" => Some(8),
            "VISIBLE_STRING" | "DOMAIN" => None,
            other => panic!("{other}"),
        }
    }

    fn is_writable(&self) -> bool {
        matches!(self.access, "rw" | "wo")
    }

    /// The default value as an upload gives it; `None` for what is measured or cannot be read.
    fn default(&self) -> Option<Vec<u8>> {
        let number = |value: i64| value.to_le_bytes()[..self.size().unwrap()].to_vec();
        let setup = setup();
        Some(match self.default {
            "$MEASURED" | "$NONE" => return None,
            "$VENDOR" => number(VENDOR_ID.into()),
            "$PRODUCT" => number(Personality::Pressure.product_code().into()),
            "$REVISION" => number(REVISION.into()),
            "$SERIAL" => number(setup.serial_number.into()),
            "$PROGRAM" => number(setup.program_id.into()),
            "$HARDWARE" => setup.hardware_version.into(),
            "$SOFTWARE" => setup.software_version.into(),
            text if text.starts_with('"') => text.trim_matches('"').into(),
            text if self.kind == "REAL32" => text.parse::<f32>().unwrap().to_le_bytes().to_vec(),
            text => match text.strip_prefix("$NODEID+") {
                Some(base) => number(integer(base) + i64::from(ID)),
                None => number(integer(text)),
            },
        })
    }

    fn mapping_entry(&self) -> [u8; 4] {
        let bits = u8::try_from(self.size().unwrap_or(0) * 8).unwrap();
        let [low, high] = self.index.to_le_bytes();
        [bits, self.sub, low, high]
    }
}

fn integer(text: &str) -> i64 {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).unwrap(),
        None => text.parse().unwrap(),
    }
}

fn table() -> impl Iterator<Item = Row> {
    [TRANSMITTER, COMMUNICATION].into_iter().flat_map(|table| table.lines().skip(1)).map(Row::parse)
}

#[test]
fn the_node_has_nothing_that_the_tables_do_not_know() {
    let key = |row: Row| (row.index, row.sub, row.name.to_string());
    let own: BTreeSet<_> = OBJECTS.iter().map(|row| (row.index, row.sub, row.name.to_string())).collect();
    assert_eq!(table().map(key).collect::<BTreeSet<_>>(), own);
}

#[test]
fn reading_gives_the_default_in_the_size_of_the_type() {
    for row in table() {
        let result = Bench::booted().read(row.index, row.sub);
        let expected = match (row.access, row.index) {
            ("wo", _) => Err(WRITE_ONLY),
            (_, 0x1003) if row.sub > 0 => Err(NO_DATA),
            // Nothing was written to it yet.
            (_, 0x2F00) => Err(NO_DATA),
            _ => Ok(row.default().unwrap_or_else(|| vec![0; row.size().unwrap()])),
        };
        assert_eq!(result, expected, "{row:X?}");
    }
}

#[test]
fn writing_is_refused_or_taken_as_the_access_says() {
    for row in table() {
        let mut bench = Bench::booted();
        let size = row.size().unwrap_or(4);
        if !row.is_writable() {
            assert_eq!(bench.write(row.index, row.sub, &[0; 4][..size]), Err(READ_ONLY), "{row:X?}");
            continue;
        }
        // What a valid TPDO protects can only be written after steps 1 and 2 of the mapping procedure.
        (0..2).for_each(|number| bench.disable_tpdo(number));
        let value = match row.index {
            0x6125 => b"zero".to_vec(),
            0x1010 => b"save".to_vec(),
            0x1011 => b"load".to_vec(),
            0x2F00 => vec![1, 2, 3],
            _ => bench.read(row.index, row.sub).unwrap(),
        };
        assert_eq!(bench.write(row.index, row.sub, &value), Ok(()), "{row:X?}");
    }
}

#[test]
fn a_value_of_the_wrong_length_is_refused() {
    for row in table().filter(Row::is_writable) {
        let mut bench = Bench::booted();
        let Some(size) = row.size() else { continue };
        if size < 4 {
            assert_eq!(bench.write(row.index, row.sub, &[0; 4][..=size]), Err(TOO_LONG), "{row:X?}");
        }
        if size > 1 {
            assert_eq!(bench.write(row.index, row.sub, &[0; 8][..size - 1]), Err(TOO_SHORT), "{row:X?}");
        }
    }
}

#[test]
fn what_can_be_mapped_is_sent_and_the_rest_is_refused() {
    for row in table() {
        let mut bench = Bench::booted();
        bench.disable_tpdo(0);
        bench.disable_tpdo(1);
        let mapped = bench.write(0x1A01, 1, &row.mapping_entry());
        if row.mapping == "no" {
            assert_eq!(mapped, Err(NOT_MAPPABLE), "{row:X?}");
            continue;
        }
        assert_eq!(mapped, Ok(()), "{row:X?}");
        let id = 0x280 + u16::from(ID);
        bench.write(0x1A01, 0, &[1]).unwrap();
        bench.write(0x1801, 1, &u32::from(id).to_le_bytes()).unwrap();
        bench.nmt(1);
        let value = bench.read(row.index, row.sub).unwrap();
        assert!(bench.take().contains(&(id, value)), "{row:X?}");
    }
}

#[test]
fn the_node_s_table_has_the_access_and_the_type_of_the_row() {
    use canopen::dictionary::{Access, Type};
    for row in table() {
        let own = OBJECTS.iter().find(|own| (own.index, own.sub) == (row.index, row.sub)).unwrap();
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
        assert_eq!((access, kind.as_str()), (row.access, row.kind), "{row:X?}");
    }
}
