//! The electronic data sheet (CiA 306) of a table of rows, for configuration tools and masters.
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
//! assert!(sheet.contains("[1000]\n") && sheet.contains("ProductName=I/O module\n"));
//! # Ok::<(), core::fmt::Error>(())
//! ```

use core::fmt::{Result, Write};

use crate::dictionary::{Access, DefaultValue, Mapping, Object, Type};

/// Entries of the data sheet that do not follow from the rows.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct DeviceInfo<'a> {
    /// Name of the vendor.
    pub vendor: &'a str,
    /// Name of the product.
    pub product: &'a str,
    /// Name of the file.
    pub file_name: &'a str,
    /// Revision of the file.
    pub file_revision: u8,
    /// Day and time of the edition, such as `11-25-2026` and `12:00AM`; `None` for a data sheet without a date.
    pub date: Option<(&'a str, &'a str)>,
    /// The bit rates of the device in kbit/s.
    pub bit_rates: &'a [u16],
    /// Whether the device has an LSS slave ([`Application::LSS`](crate::Application::LSS)).
    pub has_lss: bool,
}

impl<'a> DeviceInfo<'a> {
    /// A device with all bit rates and with LSS, and a file `device.eds` without a date.
    #[must_use]
    pub const fn new(vendor: &'a str, product: &'a str) -> DeviceInfo<'a> {
        DeviceInfo {
            vendor,
            product,
            file_name: "device.eds",
            file_revision: 0,
            date: None,
            bit_rates: &BIT_RATES,
            has_lss: true,
        }
    }
}

/// Bit rates of CiA 301 in kbit/s.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// Writes the data sheet of a device.
///
/// # Errors
/// Errors of `out`.
pub fn write(rows: &[Object], device: &DeviceInfo<'_>, out: &mut impl Write) -> Result {
    info(rows, device, out)?;
    lists(rows, out)?;
    rows.chunk_by(|row, next| row.index == next.index).try_for_each(|object| write_object(object, out))
}

fn info(rows: &[Object], device: &DeviceInfo<'_>, out: &mut impl Write) -> Result {
    let number = |index, sub| {
        rows.iter().find(|row| (row.index, row.sub) == (index, sub)).map_or(0, |row| match row.default {
            DefaultValue::Integer(value) => value,
            _ => 0,
        })
    };
    let count = |first: u16| rows.iter().filter(|row| row.sub == 0 && row.index & 0xFE00 == first).count();
    writeln!(out, "[FileInfo]\nFileName={}\nFileVersion=1", device.file_name)?;
    writeln!(out, "FileRevision={}\nEDSVersion=4.0\nDescription={}", device.file_revision, device.product)?;
    if let Some((day, time)) = device.date {
        writeln!(out, "CreationDate={day}\nCreationTime={time}")?;
        writeln!(out, "ModificationDate={day}\nModificationTime={time}\nModifiedBy={}", device.vendor)?;
    }
    writeln!(out, "CreatedBy={}\n", device.vendor)?;
    writeln!(out, "[DeviceInfo]\nVendorName={}\nVendorNumber=0x{:08X}", device.vendor, number(0x1018, 1))?;
    writeln!(out, "ProductName={}\nProductNumber=0x{:08X}", device.product, number(0x1018, 2))?;
    writeln!(out, "RevisionNumber=0x{:08X}\nOrderCode={}", number(0x1018, 3), device.product)?;
    for rate in BIT_RATES {
        writeln!(out, "BaudRate_{rate}={}", u8::from(device.bit_rates.contains(&rate)))?;
    }
    writeln!(out, "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=0")?;
    writeln!(
        out,
        "CompactPDO=0\nGroupMessaging=0\nNrOfRXPDO={}\nNrOfTXPDO={}",
        count(0x1400),
        count(0x1800)
    )?;
    writeln!(out, "LSS_Supported={}\n\n[DummyUsage]", u8::from(device.has_lss))?;
    (1..=7).try_for_each(|kind| writeln!(out, "Dummy{kind:04X}={}", u8::from(kind > 1)))?;
    writeln!(out, "\n[Comments]\nLines=0\n")
}

/// The lists of mandatory, optional and manufacturer-specific objects.
fn lists(rows: &[Object], out: &mut impl Write) -> Result {
    let is_mandatory = |index: u16| matches!(index, 0x1000 | 0x1001 | 0x1018);
    let is_manufacturer = |index: u16| matches!(index, 0x2000..=0x5FFF);
    list("MandatoryObjects", rows, is_mandatory, out)?;
    list("OptionalObjects", rows, |index| !is_mandatory(index) && !is_manufacturer(index), out)?;
    list("ManufacturerObjects", rows, is_manufacturer, out)
}

fn list(name: &str, rows: &[Object], is_listed: impl Fn(u16) -> bool, out: &mut impl Write) -> Result {
    let listed = || {
        let objects = rows.chunk_by(|row, next| row.index == next.index);
        objects.filter_map(|object| object.first().map(|row| row.index)).filter(|index| is_listed(*index))
    };
    writeln!(out, "[{name}]\nSupportedObjects={}", listed().count())?;
    for (number, index) in (1..).zip(listed()) {
        let number: u32 = number;
        writeln!(out, "{number}=0x{index:04X}")?;
    }
    writeln!(out)
}

fn write_object(rows: &[Object], out: &mut impl Write) -> Result {
    let Some((head, subs)) = rows.split_first() else { return Ok(()) };
    if subs.is_empty() && !is_record(head.index) {
        writeln!(out, "[{:04X}]\nParameterName={}", head.index, head.name)?;
        let object_type = if head.kind == Type::Domain { 2 } else { 7 };
        return write_entry(head, object_type, out);
    }
    let first = subs.first().map(|row| row.kind.code());
    let is_array = !is_record(head.index) && subs.iter().all(|row| Some(row.kind.code()) == first);
    writeln!(out, "[{:04X}]\nParameterName={}", head.index, head.name)?;
    writeln!(out, "ObjectType=0x{}\nSubNumber={}\n", if is_array { 8 } else { 9 }, rows.len())?;
    for row in rows {
        writeln!(out, "[{:04X}sub{:X}]", row.index, row.sub)?;
        let is_repeated = rows.iter().filter(|other| other.sub != 0 && other.name == row.name).count() > 1;
        match row.sub {
            0 => writeln!(out, "ParameterName=Number of entries")?,
            sub if is_repeated => writeln!(out, "ParameterName={} {sub}", row.name)?,
            _ => writeln!(out, "ParameterName={}", row.name)?,
        }
        write_entry(row, if row.kind == Type::Domain { 2 } else { 7 }, out)?;
    }
    Ok(())
}

/// Whether CiA 301 defines the object as a record: identity and PDO parameters.
const fn is_record(index: u16) -> bool {
    matches!(index, 0x1018 | 0x1400..=0x1BFF)
}

fn write_entry(row: &Object, object_type: u8, out: &mut impl Write) -> Result {
    let access = match (row.access, row.mapping) {
        (Access::Const, _) => "const",
        (Access::ReadOnly, _) => "ro",
        (Access::WriteOnly, _) => "wo",
        (Access::ReadWrite, Mapping::Tpdo) => "rwr",
        (Access::ReadWrite, Mapping::Rpdo) => "rww",
        (Access::ReadWrite, Mapping::No | Mapping::Both) => "rw",
    };
    writeln!(out, "ObjectType=0x{object_type}\nDataType=0x{:04X}\nAccessType={access}", row.kind.code())?;
    match row.default {
        DefaultValue::Integer(bits) if row.kind == Type::Real64 => {
            writeln!(out, "DefaultValue={:?}", f64::from_bits(bits.cast_unsigned()))?;
        }
        DefaultValue::Integer(value) => writeln!(out, "DefaultValue={value}")?,
        DefaultValue::Real(value) => writeln!(out, "DefaultValue={value:?}")?,
        DefaultValue::Text(text) => writeln!(out, "DefaultValue={text}")?,
        DefaultValue::NodeId(base) => writeln!(out, "DefaultValue=$NODEID+0x{base:X}")?,
        DefaultValue::None => (),
    }
    if let Some((low, high)) = row.limits {
        writeln!(out, "LowLimit={low}\nHighLimit={high}")?;
    }
    if row.flags() != 0 {
        writeln!(out, "ObjFlags=0x{:X}", row.flags())?;
    }
    writeln!(out, "PDOMapping={}\n", u8::from(row.mapping != Mapping::No))
}
