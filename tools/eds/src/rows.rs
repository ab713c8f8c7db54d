//! Data sheets from dictionary tables.

use std::collections::BTreeMap;

use canopen::dictionary::{Access as RowAccess, DefaultValue, Mapping, Object as Row};
use profiles::product::{REVISION, VENDOR_ID};

use crate::read::BIT_RATES;
use crate::{Access, DataType, Device, DeviceInfo, Eds, Entry, Flags, Formula, Object, ObjectType, Value};

/// Vendor and order code. CiA has assigned no vendor-ID to the project, and the keys must not be empty.
const NONE: &str = "none";

/// Every data type of the dictionary is made of whole bytes.
const GRANULARITY: u8 = 8;

impl Device {
    /// The data sheet as a value.
    #[must_use]
    pub fn eds(&self) -> Eds {
        let objects = self.objects().map(|rows| self.object(rows)).map(|object| (object.index, object));
        let mut eds = Eds { device: self.info(), objects: objects.collect(), ..Eds::default() };
        eds.drop_unused_flags();
        eds
    }

    /// The rows of each object.
    pub(crate) fn objects(&self) -> impl Iterator<Item = &'static [Row]> {
        self.rows.chunk_by(|row, next| row.index == next.index)
    }

    fn info(&self) -> DeviceInfo {
        let count = |first: u16| self.objects().filter(|rows| rows[0].index & 0xFE00 == first).count();
        DeviceInfo {
            vendor_name: NONE.into(),
            vendor_number: VENDOR_ID,
            product_name: self.product_name().into(),
            product_number: self.personality.product_code(),
            revision_number: REVISION,
            order_code: NONE.into(),
            bit_rates: BIT_RATES.iter().map(|(rate, _)| *rate).collect(),
            granularity: GRANULARITY,
            group_messaging: self.rows.iter().any(is_mpdo),
            rpdos: u16::try_from(count(0x1400)).unwrap_or(u16::MAX),
            tpdos: u16::try_from(count(0x1800)).unwrap_or(u16::MAX),
            lss: true,
        }
    }

    /// Object 1008h.
    fn product_name(&self) -> &'static str {
        match self.rows.iter().find(|row| row.index == 0x1008).map(|row| row.default) {
            Some(DefaultValue::Text(name)) => name,
            _ => self.description,
        }
    }

    fn object(&self, rows: &[Row]) -> Object {
        let object_type = object_type(rows);
        let entry = |row: &Row| (row.sub, self.entry(row, entry_name(row, rows, object_type)));
        let entries: BTreeMap<u8, Entry> = rows.iter().map(entry).collect();
        Object { index: rows[0].index, name: rows[0].name.into(), object_type, entries }
    }

    fn entry(&self, row: &Row, name: String) -> Entry {
        let constant = |value: i64| Formula::Constant(Value::Integer(value.into()));
        Entry {
            index: row.index,
            sub: row.sub,
            name,
            data_type: DataType(row.kind.code()),
            access: access(row),
            default: self.default(row),
            value: None,
            low: row.limits.map(|(low, _)| constant(low)),
            high: row.limits.map(|(_, high)| constant(high)),
            mappable: row.mapping != Mapping::No,
            flags: Some(Flags(row.flags().into())),
            unit: row.unit.into(),
        }
    }

    /// The default of a row. The table has no identity, because the node itself fills it in. The serial number differs
    /// in each device, and the identification of the program in each version.
    fn default(&self, row: &Row) -> Option<Formula> {
        let number = |value: u32| Some(Formula::Constant(Value::Integer(value.into())));
        match (row.index, row.sub) {
            (0x1018, 1) => number(VENDOR_ID),
            (0x1018, 2) => number(self.personality.product_code()),
            (0x1018, 3) => number(REVISION),
            (0x1018, 4) | (0x1F56, 1) => None,
            _ => default(row.default),
        }
    }
}

/// Whether a row belongs to a multiplexed PDO: its number of mapped objects has a special value (CiA 301, 7.5.2.36 and
/// 7.5.2.38).
fn is_mpdo(row: &Row) -> bool {
    let is_count = row.sub == 0 && matches!(row.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF);
    is_count && matches!(row.default, DefaultValue::Integer(254..=255))
}

/// A default of the table. The node also fills in the strings that are empty in the table.
fn default(value: DefaultValue) -> Option<Formula> {
    Some(match value {
        DefaultValue::Integer(value) => Formula::Constant(Value::Integer(value.into())),
        DefaultValue::Real(value) => Formula::Constant(Value::Real(value.into())),
        DefaultValue::NodeId(base) => Formula::NodeId(base.into()),
        DefaultValue::Text("") | DefaultValue::None => return None,
        DefaultValue::Text(text) => Formula::Constant(Value::Text(text.into())),
    })
}

/// The access type of a row. For a parameter that a PDO carries, the access type is the direction of the PDO,
/// because CiA 306 has no other place for the direction.
fn access(row: &Row) -> Access {
    match (row.access, row.mapping) {
        (RowAccess::Const, _) => Access::Const,
        (RowAccess::ReadOnly, _) => Access::ReadOnly,
        (RowAccess::WriteOnly, _) => Access::WriteOnly,
        (RowAccess::ReadWrite, Mapping::No | Mapping::Both) => Access::ReadWrite,
        (RowAccess::ReadWrite, Mapping::Tpdo) => Access::ReadWriteInput,
        (RowAccess::ReadWrite, Mapping::Rpdo) => Access::ReadWriteOutput,
    }
}

/// The type of an object. An object of one row is a variable or a domain. An object of several rows is an array when
/// all rows beyond sub-index 0 have the same type. Objects that CiA 301 calls a record are records in any case, also
/// the mapping of a multiplexed PDO, whose only entry is the number of entries.
pub(crate) fn object_type(rows: &[Row]) -> ObjectType {
    let type_of = |row: &Row| DataType(row.kind.code());
    match rows {
        [row] if type_of(row) == DataType::DOMAIN => ObjectType::Domain,
        [head, ..] if is_record(head.index) => ObjectType::Record,
        [_] => ObjectType::Var,
        [_, subs @ ..] if subs.windows(2).all(|pair| type_of(&pair[0]) == type_of(&pair[1])) => {
            ObjectType::Array
        }
        _ => ObjectType::Record,
    }
}

/// The records of CiA 301 (7.5.2): identity, OS command, SDO and PDO parameters.
fn is_record(index: u16) -> bool {
    matches!(index, 0x1018 | 0x1023 | 0x1025 | 0x1200..=0x12FF | 0x1400..=0x1BFF)
}

/// The name of an entry. The table gives one name to an object and its sub-index 0. A writable sub-index 0 counts the
/// entries in use (1003h, 1600h, 1A00h); any other sub-index 0 is fixed. Sub-indices of the same name get their number.
fn entry_name(row: &Row, rows: &[Row], object_type: ObjectType) -> String {
    let is_repeated = rows.iter().filter(|other| other.sub != 0 && other.name == row.name).count() > 1;
    match row.sub {
        0 if object_type.has_subs() && row.access.is_writable() => "Number of entries".into(),
        0 if object_type.has_subs() => "Highest sub-index supported".into(),
        sub if is_repeated => format!("{} {sub}", row.name),
        _ => row.name.into(),
    }
}
