//! Writer of data sheets: from [`Eds`] to text (CiA 306). The text is the same on every run.

use std::fmt::{self, Display, Write};

use profiles::product::REVISION;

use crate::read::BIT_RATES;
use crate::{Device, DeviceInfo, Edition, Eds, Entry, Flags, Object, ObjectType, Reals};

/// Day of the first release, month first (CiA 306).
const CREATION_DATE: &str = "11-21-2026";
const TIME: &str = "12:00AM";
const AUTHOR: &str = "cargo xtask eds";

const COMMENTS: [&str; 2] = [
    "Generated from the dictionary table of the firmware by cargo xtask eds. Do not edit.",
    "The comment above a section is the physical unit; an index there is the object that selects the unit.",
];

/// Data types that an RPDO can skip: the integer types (CiA 301, 7.4.7.1). BOOLEAN is no whole byte.
const DUMMIES: [(&str, u8); 7] = [
    ("Dummy0001", 0),
    ("Dummy0002", 1),
    ("Dummy0003", 1),
    ("Dummy0004", 1),
    ("Dummy0005", 1),
    ("Dummy0006", 1),
    ("Dummy0007", 1),
];

impl Device {
    /// The text of the data sheet in an edition.
    #[must_use]
    pub fn sheet(&self, edition: &Edition) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(edition, &mut Sections { out: &mut text, reals: Reals::Bits });
        text
    }

    fn write(&self, edition: &Edition, out: &mut Sections) -> fmt::Result {
        let eds = self.eds();
        self.file_info(edition, out)?;
        device_info(&eds.device, out)?;
        dummies(out)?;
        comments(out)?;
        object_lists(&eds, out)
    }

    fn file_info(&self, edition: &Edition, out: &mut Sections) -> fmt::Result {
        out.section("FileInfo", "")?;
        out.key("FileName", self.file_name)?;
        out.key("FileVersion", REVISION >> 16)?;
        out.key("FileRevision", edition.revision)?;
        out.key("EDSVersion", "4.0")?;
        out.key("Description", self.description)?;
        out.key("CreationTime", TIME)?;
        out.key("CreationDate", CREATION_DATE)?;
        out.key("CreatedBy", AUTHOR)?;
        out.key("ModificationTime", TIME)?;
        out.key("ModificationDate", &edition.date)?;
        out.key("ModifiedBy", AUTHOR)
    }
}

pub(crate) fn device_info(device: &DeviceInfo, out: &mut Sections) -> fmt::Result {
    out.section("DeviceInfo", "")?;
    out.key("VendorName", &device.vendor_name)?;
    out.key("VendorNumber", hex32(device.vendor_number))?;
    out.key("ProductName", &device.product_name)?;
    out.key("ProductNumber", hex32(device.product_number))?;
    out.key("RevisionNumber", hex32(device.revision_number))?;
    out.key("OrderCode", &device.order_code)?;
    for (rate, key) in BIT_RATES {
        out.key(key, u8::from(device.bit_rates.contains(&rate)))?;
    }
    out.key("SimpleBootUpMaster", 0)?;
    out.key("SimpleBootUpSlave", 1)?;
    out.key("Granularity", device.granularity)?;
    out.key("DynamicChannelsSupported", 0)?;
    out.key("CompactPDO", 0)?;
    out.key("GroupMessaging", u8::from(device.group_messaging))?;
    out.key("NrOfRXPDO", device.rpdos)?;
    out.key("NrOfTXPDO", device.tpdos)?;
    out.key("LSS_Supported", u8::from(device.lss))
}

/// The sections behind the device that data sheets and configuration files share.
pub(crate) fn write_lists(eds: &Eds, out: &mut Sections) -> fmt::Result {
    dummies(out)?;
    object_lists(eds, out)
}

fn dummies(out: &mut Sections) -> fmt::Result {
    out.section("DummyUsage", "")?;
    DUMMIES.into_iter().try_for_each(|(key, used)| out.key(key, used))
}

fn object_lists(eds: &Eds, out: &mut Sections) -> fmt::Result {
    eds.objects("MandatoryObjects", is_mandatory, out)?;
    eds.objects("OptionalObjects", |index| !is_mandatory(index) && !is_manufacturer(index), out)?;
    eds.objects("ManufacturerObjects", is_manufacturer, out)
}

fn comments(out: &mut Sections) -> fmt::Result {
    out.section("Comments", "")?;
    out.key("Lines", COMMENTS.len())?;
    (1..).zip(COMMENTS).try_for_each(|(i, line)| out.key(&format!("Line{i}"), line))
}

/// Whether an object is mandatory for every device (CiA 301).
fn is_mandatory(index: u16) -> bool {
    matches!(index, 0x1000 | 0x1001 | 0x1018)
}

fn is_manufacturer(index: u16) -> bool {
    (0x2000..0x6000).contains(&index)
}

fn hex32(value: u32) -> String {
    format!("0x{value:08X}")
}

impl Eds {
    /// A list of objects, then each of them.
    fn objects(&self, list: &str, belongs: impl Fn(u16) -> bool, out: &mut Sections) -> fmt::Result {
        let objects: Vec<&Object> = self.objects.values().filter(|object| belongs(object.index)).collect();
        out.section(list, "")?;
        out.key("SupportedObjects", objects.len())?;
        for (i, object) in (1..).zip(&objects) {
            out.key(&format!("{i}"), format_args!("0x{:04X}", object.index))?;
        }
        objects.into_iter().try_for_each(|object| write_object(object, out))
    }
}

fn write_object(object: &Object, out: &mut Sections) -> fmt::Result {
    let section = format!("{:04X}", object.index);
    if !object.object_type.has_subs() {
        return object.entries.values().try_for_each(|entry| write_entry(entry, &section, out));
    }
    out.section(&section, "")?;
    out.key("ParameterName", &object.name)?;
    out.key("ObjectType", format_args!("0x{:X}", object.object_type.code()))?;
    out.key("SubNumber", object.entries.len())?;
    object
        .entries
        .values()
        .try_for_each(|entry| write_entry(entry, &format!("{section}sub{:X}", entry.sub), out))
}

fn write_entry(entry: &Entry, section: &str, out: &mut Sections) -> fmt::Result {
    out.section(section, &entry.unit)?;
    out.key("ParameterName", &entry.name)?;
    out.key("ObjectType", format_args!("0x{:X}", entry.object_type().code()))?;
    out.key("DataType", format_args!("0x{:04X}", entry.data_type.0))?;
    out.key("AccessType", entry.access.text())?;
    let values = [
        ("DefaultValue", &entry.default, Reals::Bits),
        ("ParameterValue", &entry.value, out.reals),
        ("LowLimit", &entry.low, Reals::Bits),
        ("HighLimit", &entry.high, Reals::Bits),
    ];
    for (key, value, reals) in values {
        if let Some(value) = value {
            out.key(key, value.text(entry.data_type, reals))?;
        }
    }
    if let Some(Flags(flags @ 1..)) = entry.flags {
        out.key("ObjFlags", format_args!("0x{flags:X}"))?;
    }
    // CiA 306 has no such key for a domain, because no PDO carries one. The package canopen of npm refuses the key
    // there.
    if entry.object_type() == ObjectType::Domain {
        return Ok(());
    }
    out.key("PDOMapping", u8::from(entry.mappable))
}

/// Sections of keys, with the line ends of CiA 306.
pub(crate) struct Sections<'a> {
    pub(crate) out: &'a mut String,
    /// The form of real numbers that are the value of a parameter.
    pub(crate) reals: Reals,
}

impl Sections<'_> {
    /// Begins a section. The unit is a comment above the section, because every reader accepts a comment there. A key
    /// `Unit`, which python-canopen reads, makes Lely's tools refuse the whole file.
    pub(crate) fn section(&mut self, name: &str, unit: &str) -> fmt::Result {
        if !self.out.is_empty() {
            self.out.write_str("\r\n")?;
        }
        if !unit.is_empty() {
            write!(self.out, "; Unit: {unit}\r\n")?;
        }
        write!(self.out, "[{name}]\r\n")
    }

    pub(crate) fn key(&mut self, key: &str, value: impl Display) -> fmt::Result {
        write!(self.out, "{key}={value}\r\n")
    }
}
