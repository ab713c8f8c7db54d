//! The electronic data sheet (CiA 306) of a table of rows, for configuration tools and masters. [`Writer`] has the form alone,
//! for a program that describes devices in another way or writes configuration files.
//!
//! ```
//! use canopen::eds::DeviceInfo;
//! use canopen::{dictionary::Object, objects};
//!
//! const ROWS: &[Object] =
//!     canopen::rows!([objects::device_type(401), objects::error_register()], objects::identity(7, 1, 1));
//!
//! let mut sheet = String::new();
//! canopen::eds::write(ROWS, &DeviceInfo::new("Example", "I/O module"), &mut sheet)?;
//! assert!(sheet.contains("[1000]\r\n") && sheet.contains("ProductName=I/O module\r\n"));
//! # Ok::<(), core::fmt::Error>(())
//! ```

mod writer;

pub use writer::{ARRAY, BIT_RATES, DOMAIN, DeviceKeys, EntryKeys, RECORD, VARIABLE, Writer};

use core::fmt::{self, Display, Formatter, Result, Write};

use crate::dictionary::{Access, DefaultValue, Mapping, Object, Type};

/// Entries of the data sheet that do not follow from the rows.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct DeviceInfo<'a> {
    /// Name of the vendor.
    pub vendor: &'a str,
    /// Name of the product.
    pub product: &'a str,
    /// The device in one line.
    pub description: &'a str,
    /// Order code.
    pub order_code: &'a str,
    /// Name of the file.
    pub file_name: &'a str,
    /// Version of the file.
    pub file_version: u16,
    /// Revision of the file.
    pub file_revision: u8,
    /// Author of the file.
    pub author: &'a str,
    /// Day and time of the first edition, such as `11-25-2026` and `12:00AM`; `None` for a data sheet without this date.
    pub created: Option<(&'a str, &'a str)>,
    /// Day and time of this edition; `None` for a data sheet without this date.
    pub modified: Option<(&'a str, &'a str)>,
    /// The bit rates of the device in kbit/s.
    pub bit_rates: &'a [u16],
    /// Whether the device has an LSS slave ([`Application::LSS`](crate::Application::LSS)).
    pub has_lss: bool,
    /// The form of real numbers.
    pub reals: Reals,
    /// Lines of comment.
    pub comments: &'a [&'a str],
}

/// The form of real numbers in a file. No form is read by all tools; 0 is `0` in both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reals {
    /// The bits, as `0x3FC00000`. Lely's tools refuse a file with any other form. python-canopen does not know the value
    /// then, and the package canopen of npm reads an integer.
    Bits,
    /// Decimal, as `1.5`. python-canopen and most data sheets of vendors have this form.
    Decimal,
}

impl<'a> DeviceInfo<'a> {
    /// A device with all bit rates and with LSS, and a file `device.eds` of the vendor without a date, with decimal real
    /// numbers. The name of the product is its order code, too.
    #[must_use]
    pub const fn new(vendor: &'a str, product: &'a str) -> DeviceInfo<'a> {
        DeviceInfo {
            vendor,
            product,
            description: product,
            order_code: product,
            file_name: "device.eds",
            file_version: 1,
            file_revision: 0,
            author: vendor,
            created: None,
            modified: None,
            bit_rates: &BIT_RATES,
            has_lss: true,
            reals: Reals::Decimal,
            comments: &[],
        }
    }
}

/// Writes the data sheet of a device.
///
/// # Errors
/// Errors of `out`.
pub fn write(rows: &[Object], device: &DeviceInfo<'_>, out: &mut impl Write) -> Result {
    let mut out = Writer::new(out);
    write_file_info(device, &mut out)?;
    out.device(&device_keys(rows, device))?;
    out.dummies()?;
    out.comments(device.comments)?;
    let objects = rows.chunk_by(|row, next| row.index == next.index);
    let index = |object: &&[Object]| object.first().map_or(0, |row| row.index);
    out.objects(&objects, index, |out, rows| write_object(rows, device.reals, out))
}

fn write_file_info<W: Write>(device: &DeviceInfo<'_>, out: &mut Writer<'_, W>) -> Result {
    out.section("FileInfo", "")?;
    out.key("FileName", device.file_name)?;
    out.key("FileVersion", device.file_version)?;
    out.key("FileRevision", device.file_revision)?;
    out.key("EDSVersion", "4.0")?;
    out.key("Description", device.description)?;
    if let Some((day, time)) = device.created {
        out.key("CreationTime", time)?;
        out.key("CreationDate", day)?;
    }
    out.key("CreatedBy", device.author)?;
    if let Some((day, time)) = device.modified {
        out.key("ModificationTime", time)?;
        out.key("ModificationDate", day)?;
        out.key("ModifiedBy", device.author)?;
    }
    Ok(())
}

/// The keys of section `[DeviceInfo]`; the identity is the default of 1018h.
fn device_keys<'a>(rows: &[Object], device: &DeviceInfo<'a>) -> DeviceKeys<'a> {
    let identity = |sub| {
        let row = rows.iter().find(|row| (row.index, row.sub) == (0x1018, sub));
        match row.map(|row| row.default) {
            Some(DefaultValue::Integer(value)) => u32::try_from(value).unwrap_or(0),
            _ => 0,
        }
    };
    let count = |first: u16| {
        let count = rows.iter().filter(|row| row.sub == 0 && row.index & 0xFE00 == first).count();
        u16::try_from(count).unwrap_or(u16::MAX)
    };
    DeviceKeys {
        vendor: device.vendor,
        vendor_id: identity(1),
        product: device.product,
        product_code: identity(2),
        revision: identity(3),
        order_code: device.order_code,
        bit_rates: device.bit_rates,
        granularity: 8,
        has_multiplexed_pdos: rows.iter().any(is_multiplexed),
        rpdos: count(0x1400),
        tpdos: count(0x1800),
        has_lss: device.has_lss,
    }
}

/// Whether a row belongs to a multiplexed PDO: its number of mapped objects has a special value (CiA 301, 7.5.2.36 and
/// 7.5.2.38).
fn is_multiplexed(row: &Object) -> bool {
    let is_count = row.sub == 0 && matches!(row.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF);
    is_count && matches!(row.default, DefaultValue::Integer(254..=255))
}

fn write_object<W: Write>(rows: &[Object], reals: Reals, out: &mut Writer<'_, W>) -> Result {
    let Some(head) = rows.first() else { return Ok(()) };
    let object_type = object_type(rows);
    if matches!(object_type, ARRAY | RECORD) {
        out.object(head.index, head.name, object_type, rows.len())?;
    }
    rows.iter().try_for_each(|row| write_entry(row, rows, object_type, reals, out))
}

/// The type of an object. An object of one row is a variable or a domain. An object of several rows is an array when
/// all rows beyond sub-index 0 have the same type. Objects that CiA 301 calls a record are records in any case, also
/// the mapping of a multiplexed PDO, whose only entry is the number of entries.
fn object_type(rows: &[Object]) -> u8 {
    match rows {
        [row] if row.kind == Type::Domain => DOMAIN,
        [head, ..] if is_record(head.index) => RECORD,
        [_] => VARIABLE,
        [_, first, others @ ..] if others.iter().all(|row| row.kind.code() == first.kind.code()) => ARRAY,
        _ => RECORD,
    }
}

/// The records of CiA 301 (7.5.2): identity, OS command, SDO and PDO parameters.
const fn is_record(index: u16) -> bool {
    matches!(index, 0x1018 | 0x1023 | 0x1025 | 0x1200..=0x12FF | 0x1400..=0x1BFF)
}

fn write_entry<W: Write>(
    row: &Object,
    rows: &[Object],
    object_type: u8,
    reals: Reals,
    out: &mut Writer<'_, W>,
) -> Result {
    let has_subs = matches!(object_type, ARRAY | RECORD);
    let default = Default(row, reals);
    let (low, high) = row.limits.unwrap_or_default();
    let (low, high) = (Number(low, row.kind, reals), Number(high, row.kind, reals));
    let values: [(&str, &dyn Display); 3] =
        [("DefaultValue", &default), ("LowLimit", &low), ("HighLimit", &high)];
    let (defaults, limits) = values.split_at(1);
    let values = match (default.is_written(), row.limits.is_some()) {
        (true, true) => &values,
        (true, false) => defaults,
        (false, true) => limits,
        (false, false) => &[],
    };
    out.entry(&EntryKeys {
        index: row.index,
        sub: has_subs.then_some(row.sub),
        unit: row.unit,
        name: &EntryName { row, rows, has_subs },
        object_type: if row.kind == Type::Domain { DOMAIN } else { VARIABLE },
        data_type: row.kind.code(),
        access: access(row),
        values,
        flags: row.flags().into(),
        is_mappable: row.mapping != Mapping::No,
    })
}

/// The access type of a row. For a parameter that a PDO carries, the access type is the direction of the PDO, because
/// CiA 306 has no other place for the direction.
const fn access(row: &Object) -> &'static str {
    match (row.access, row.mapping) {
        (Access::Const, _) => "const",
        (Access::ReadOnly, _) => "ro",
        (Access::WriteOnly, _) => "wo",
        (Access::ReadWrite, Mapping::Tpdo) => "rwr",
        (Access::ReadWrite, Mapping::Rpdo) => "rww",
        (Access::ReadWrite, Mapping::No | Mapping::Both) => "rw",
    }
}

/// The name of an entry. A row has one name for an object and its sub-index 0. A writable sub-index 0 counts the
/// entries in use (1003h, 1600h, 1A00h); any other sub-index 0 is fixed. Sub-indices of the same name get their number.
struct EntryName<'a> {
    row: &'a Object,
    rows: &'a [Object],
    has_subs: bool,
}

impl Display for EntryName<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let EntryName { row, rows, has_subs } = self;
        let is_repeated = rows.iter().filter(|other| other.sub != 0 && other.name == row.name).count() > 1;
        match row.sub {
            0 if *has_subs && row.access.is_writable() => f.write_str("Number of entries"),
            0 if *has_subs => f.write_str("Highest sub-index supported"),
            sub if is_repeated => write!(f, "{} {sub}", row.name),
            _ => f.write_str(row.name),
        }
    }
}

/// The default of a row. An empty text has no default in the EDS: the application writes the text.
struct Default<'a>(&'a Object, Reals);

impl Default<'_> {
    fn is_written(&self) -> bool {
        !matches!(self.0.default, DefaultValue::None | DefaultValue::Text(""))
    }
}

impl Display for Default<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0.default {
            DefaultValue::Integer(value) => Number(value, self.0.kind, self.1).fmt(f),
            DefaultValue::Real(0.0) => f.write_str("0"),
            DefaultValue::Real(value) if self.1 == Reals::Bits => write!(f, "0x{:08X}", value.to_bits()),
            DefaultValue::Real(value) => write!(f, "{value:?}"),
            DefaultValue::Text(text) => f.write_str(text),
            DefaultValue::NodeId(base) => write!(f, "$NODEID+0x{base:X}"),
            DefaultValue::None => Ok(()),
        }
    }
}

/// A number of a type. Identifiers, mapped objects and units have all their digits, because people read them digit by
/// digit. The number of a REAL64 is its bits.
struct Number(i64, Type, Reals);

impl Display for Number {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Number(value, kind, reals) = *self;
        match (kind, kind.range()) {
            (Type::Real64, _) if value == 0 => f.write_str("0"),
            (Type::Real64, _) if reals == Reals::Bits => write!(f, "0x{value:016X}"),
            (Type::Real64, _) => write!(f, "{:?}", f64::from_bits(value.cast_unsigned())),
            (_, Some((0, _))) if kind.size() >= 4 => {
                write!(f, "0x{value:0width$X}", width = 2 * usize::from(kind.size()))
            }
            _ => write!(f, "{value}"),
        }
    }
}
