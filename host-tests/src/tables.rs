//! The tables in tables/: every object of the documents, in rows. The node's own tables are not derived from them.

use std::collections::BTreeMap;

use node::{Personality, Setup};
use profiles::product::{REVISION, VENDOR_ID};

use crate::bench::{ID, setup};
use crate::lift417;

/// The objects of the CMP 8271: the communication segment, the manufacturer's objects and CiA 404.
const TRANSMITTER: &str = include_str!("../tables/cia404.csv");
/// The calibration of a transmitter.
const CALIBRATION: &str = include_str!("../tables/calibration.csv");
/// Further objects of CiA 301 in every node, and the node's own objects.
const COMMUNICATION: &str = include_str!("../tables/cia301.csv");
/// CiA 406, classes C1 and C2.
const ENCODER: &str = include_str!("../tables/cia406.csv");
/// The sensors of an encoder.
const SENSORS: &str = include_str!("../tables/encoder_sensors.csv");
/// Differences in the communication segment of an encoder.
const ENCODER_ALONE: &str = include_str!("../tables/encoder.csv");
/// Differences in the communication segment of the combined node, and the types of its two devices.
const COMBINED: &str = include_str!("../tables/combined.csv");

/// The objects of a lift device besides CiA 301 and the PDOs.
const LIFT: &str = include_str!("../tables/lift.csv");

/// An entry of a table.
#[derive(Clone, Debug)]
pub struct Row {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Name.
    pub name: &'static str,
    /// Data type, by its name in CiA 301.
    pub kind: &'static str,
    /// const, ro, wo or rw.
    pub access: &'static str,
    /// A value, or a word in capitals for a value that is not in the table.
    pub default: &'static str,
    /// no, tpdo or rpdo.
    pub mapping: &'static str,
}

impl Row {
    fn parse(line: &'static str) -> Row {
        let cells: Vec<&str> = line.split(',').collect();
        // The table of CiA 406 has a further column: the category (mandatory or not).
        let [index, sub, name, kind, access, default, mapping, ..] = cells[..] else { panic!("{line}") };
        let index = u16::try_from(integer(index)).expect("an index");
        Row { index, sub: sub.parse().expect("a sub-index"), name, kind, access, default, mapping }
    }

    /// Size of a value in bytes; `None` for a type of variable length.
    ///
    /// # Panics
    /// When the table names a type that does not exist.
    #[must_use]
    pub fn size(&self) -> Option<usize> {
        match self.kind {
            "UNSIGNED8" => Some(1),
            "UNSIGNED16" | "INTEGER16" => Some(2),
            "UNSIGNED32" | "INTEGER32" | "REAL32" => Some(4),
            "UNSIGNED48" => Some(6),
            "UNSIGNED64" => Some(8),
            "VISIBLE_STRING" | "DOMAIN" => None,
            other => panic!("{other}"),
        }
    }

    /// Whether the entry is writable.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        matches!(self.access, "rw" | "wo")
    }

    /// The default value as an upload returns it; `None` for a measured value or an unreadable object.
    ///
    /// # Panics
    /// When the default in the table does not fit the type.
    #[must_use]
    pub fn default(&self, personality: Personality) -> Option<Vec<u8>> {
        let number = |value: i64| value.to_le_bytes()[..self.size().expect("a number")].to_vec();
        let Setup { serial_number, program_id, hardware_version, software_version, .. } = setup();
        Some(match self.default {
            "$MEASURED" | "$NONE" => return None,
            "$VENDOR" => number(VENDOR_ID.into()),
            "$PRODUCT" => number(personality.product_code().into()),
            "$PERSONALITY" => number(personality.number().into()),
            "$REVISION" => number(REVISION.into()),
            "$SERIAL" => number(serial_number.into()),
            "$PROGRAM" => number(program_id.into()),
            "$HARDWARE" => hardware_version.into(),
            "$SOFTWARE" => software_version.into(),
            text if text.starts_with('"') => text.trim_matches('"').into(),
            text if self.kind == "REAL32" => text.parse::<f32>().expect("a number").to_le_bytes().to_vec(),
            text => match text.strip_prefix("$NODEID+") {
                Some(base) => number(integer(base) + i64::from(ID)),
                None => number(integer(text)),
            },
        })
    }

    /// The value of a mapping parameter that maps the object.
    ///
    /// # Panics
    /// When the object has more than 31 bytes.
    #[must_use]
    pub fn mapping_entry(&self) -> [u8; 4] {
        let bits = u8::try_from(self.size().unwrap_or(0) * 8).expect("bits");
        let [low, high] = self.index.to_le_bytes();
        [bits, self.sub, low, high]
    }
}

fn integer(text: &str) -> i64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    sign * match digits.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).expect("digits"),
        None => digits.parse().expect("digits"),
    }
}

fn rows(table: &'static str) -> impl Iterator<Item = Row> {
    table.lines().skip(1).map(Row::parse)
}

/// Whether an object belongs to the transmitter itself, not to every device.
fn is_transmitter(row: &Row) -> bool {
    row.index == 0x1002 || row.index >= 0x2000
}

/// In a module of two devices, the profile of the second is 800h higher (CiA 301, 7.5.2.1).
fn as_second_device(row: Row) -> Row {
    let shift = if row.index >= 0x6000 { 0x800 } else { 0 };
    Row { index: row.index + shift, ..row }
}

fn is_pdo(row: &Row) -> bool {
    (0x1400..=0x1BFF).contains(&row.index)
}

/// All entries that the documents specify for a node of this personality.
#[must_use]
pub fn table(personality: Personality) -> Vec<Row> {
    let (transmitter, common) = (rows(TRANSMITTER).chain(rows(CALIBRATION)), rows(COMMUNICATION));
    let encoder = || rows(ENCODER).chain(rows(SENSORS));
    let all: Vec<Row> = match personality {
        Personality::Pressure => common.chain(transmitter).collect(),
        Personality::Encoder => {
            let device = transmitter.filter(|row| !is_transmitter(row));
            device.chain(common).chain(encoder()).chain(rows(ENCODER_ALONE)).collect()
        }
        Personality::Combined => {
            let second = transmitter.map(as_second_device);
            second.chain(common).chain(encoder()).chain(rows(COMBINED)).collect()
        }
        Personality::Lift => {
            let device = transmitter.filter(|row| row.index < 0x2000 && !is_transmitter(row));
            let common = device.chain(common).filter(|row| !is_pdo(row));
            let sensors = rows(SENSORS).filter(|row| row.index < 0x2107);
            common.chain(sensors).chain(rows(CALIBRATION)).chain(lift417::rows()).chain(rows(LIFT)).collect()
        }
    };
    // Later tables are more specific and replace earlier entries.
    let entries: BTreeMap<_, _> = all.into_iter().map(|row| ((row.index, row.sub), row)).collect();
    entries.into_values().collect()
}
