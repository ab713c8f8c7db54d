//! The form of a data sheet (EDS) and of a configuration file (DCF), CiA 306: sections of keys.

use core::fmt::{Debug, Display, Formatter, Result, Write};

/// Bit rates of CiA 301 in kbit/s.
pub const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// Code of an object type: domain.
pub const DOMAIN: u8 = 2;
/// Code of an object type: variable.
pub const VARIABLE: u8 = 7;
/// Code of an object type: array.
pub const ARRAY: u8 = 8;
/// Code of an object type: record.
pub const RECORD: u8 = 9;

/// Data types that an RPDO can skip: the integer types (CiA 301, 7.4.7.1). BOOLEAN (0001h) is no whole byte.
const DUMMIES: core::ops::RangeInclusive<u16> = 2..=7;

/// The keys of section `[DeviceInfo]`.
#[derive(Clone, Copy, Debug)]
pub struct DeviceKeys<'a> {
    /// Name of the vendor.
    pub vendor: &'a str,
    /// Object 1018h:1.
    pub vendor_id: u32,
    /// Name of the product.
    pub product: &'a str,
    /// Object 1018h:2.
    pub product_code: u32,
    /// Object 1018h:3.
    pub revision: u32,
    /// Order code.
    pub order_code: &'a str,
    /// The bit rates of the device in kbit/s.
    pub bit_rates: &'a [u16],
    /// Smallest mappable part of a PDO in bits; 0 where the mapping is fixed.
    pub granularity: u8,
    /// Whether the device has multiplexed PDOs.
    pub has_multiplexed_pdos: bool,
    /// Number of RPDOs.
    pub rpdos: u16,
    /// Number of TPDOs.
    pub tpdos: u16,
    /// Whether the device is an LSS slave.
    pub has_lss: bool,
}

/// The keys of an entry.
#[derive(Clone, Copy)]
pub struct EntryKeys<'a> {
    /// Index.
    pub index: u16,
    /// Sub-index; `None` for the only entry of a variable or a domain.
    pub sub: Option<u8>,
    /// Physical unit; empty without one. CiA 306 has no place for it: it becomes a comment.
    pub unit: &'a str,
    /// Name.
    pub name: &'a dyn Display,
    /// Code of the object type.
    pub object_type: u8,
    /// Code of the data type.
    pub data_type: u16,
    /// Access type.
    pub access: &'a str,
    /// Default, value and limits with their keys.
    pub values: &'a [(&'a str, &'a dyn Display)],
    /// `ObjFlags`; 0 is not written.
    pub flags: u32,
    /// Whether a PDO can carry the entry.
    pub is_mappable: bool,
}

impl Debug for EntryKeys<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "EntryKeys({:04X}h:{}, {})", self.index, self.sub.unwrap_or(0), self.name)
    }
}

/// Writes sections of keys, with the line ends of CiA 306.
#[derive(Debug)]
pub struct Writer<'a, W> {
    out: &'a mut W,
    has_sections: bool,
}

impl<'a, W: Write> Writer<'a, W> {
    /// A file without a section.
    pub fn new(out: &'a mut W) -> Writer<'a, W> {
        Writer { out, has_sections: false }
    }

    /// Begins a section. The unit is a comment above the section, because every reader accepts a comment there. A key
    /// `Unit`, which python-canopen reads, makes Lely's tools refuse the whole file.
    ///
    /// # Errors
    /// Errors of `out`, as for every method.
    pub fn section(&mut self, name: impl Display, unit: &str) -> Result {
        if core::mem::replace(&mut self.has_sections, true) {
            self.out.write_str("\r\n")?;
        }
        if !unit.is_empty() {
            write!(self.out, "; Unit: {unit}\r\n")?;
        }
        write!(self.out, "[{name}]\r\n")
    }

    /// Writes a key of the section.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn key(&mut self, key: impl Display, value: impl Display) -> Result {
        write!(self.out, "{key}={value}\r\n")
    }

    /// Writes section `[DeviceInfo]`.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn device(&mut self, device: &DeviceKeys<'_>) -> Result {
        self.section("DeviceInfo", "")?;
        self.key("VendorName", device.vendor)?;
        self.key("VendorNumber", format_args!("0x{:08X}", device.vendor_id))?;
        self.key("ProductName", device.product)?;
        self.key("ProductNumber", format_args!("0x{:08X}", device.product_code))?;
        self.key("RevisionNumber", format_args!("0x{:08X}", device.revision))?;
        self.key("OrderCode", device.order_code)?;
        for rate in BIT_RATES {
            self.key(format_args!("BaudRate_{rate}"), u8::from(device.bit_rates.contains(&rate)))?;
        }
        self.key("SimpleBootUpMaster", 0)?;
        self.key("SimpleBootUpSlave", 1)?;
        self.key("Granularity", device.granularity)?;
        self.key("DynamicChannelsSupported", 0)?;
        self.key("CompactPDO", 0)?;
        self.key("GroupMessaging", u8::from(device.has_multiplexed_pdos))?;
        self.key("NrOfRXPDO", device.rpdos)?;
        self.key("NrOfTXPDO", device.tpdos)?;
        self.key("LSS_Supported", u8::from(device.has_lss))
    }

    /// Writes section `[DummyUsage]`: an RPDO can skip integers.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn dummies(&mut self) -> Result {
        self.section("DummyUsage", "")?;
        (1..=7)
            .try_for_each(|code| self.key(format_args!("Dummy{code:04X}"), u8::from(DUMMIES.contains(&code))))
    }

    /// Writes section `[Comments]`.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn comments(&mut self, lines: &[&str]) -> Result {
        self.section("Comments", "")?;
        self.key("Lines", lines.len())?;
        (1_u16..).zip(lines).try_for_each(|(number, line)| self.key(format_args!("Line{number}"), line))
    }

    /// Writes the lists of the mandatory, the optional and the manufacturer-specific objects, each with its objects.
    /// `index` gives the index of an object, `write` writes its sections.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn objects<T>(
        &mut self,
        objects: &(impl Iterator<Item = T> + Clone),
        index: impl Fn(&T) -> u16,
        write: impl Fn(&mut Self, T) -> Result,
    ) -> Result {
        for list in ["MandatoryObjects", "OptionalObjects", "ManufacturerObjects"] {
            let listed = objects.clone().filter(|object| list_of(index(object)) == list);
            self.section(list, "")?;
            self.key("SupportedObjects", listed.clone().count())?;
            for (number, object) in (1_u16..).zip(listed.clone()) {
                self.key(number, format_args!("0x{:04X}", index(&object)))?;
            }
            for object in listed {
                write(self, object)?;
            }
        }
        Ok(())
    }

    /// Writes the section of an array or a record. The sections of its entries follow.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn object(&mut self, index: u16, name: &str, object_type: u8, entries: usize) -> Result {
        self.section(format_args!("{index:04X}"), "")?;
        self.key("ParameterName", name)?;
        self.key("ObjectType", format_args!("0x{object_type:X}"))?;
        self.key("SubNumber", entries)
    }

    /// Writes the section of an entry.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn entry(&mut self, entry: &EntryKeys<'_>) -> Result {
        match entry.sub {
            Some(sub) => self.section(format_args!("{:04X}sub{sub:X}", entry.index), entry.unit)?,
            None => self.section(format_args!("{:04X}", entry.index), entry.unit)?,
        }
        self.key("ParameterName", entry.name)?;
        self.key("ObjectType", format_args!("0x{:X}", entry.object_type))?;
        self.key("DataType", format_args!("0x{:04X}", entry.data_type))?;
        self.key("AccessType", entry.access)?;
        for (key, value) in entry.values {
            self.key(key, value)?;
        }
        if entry.flags != 0 {
            self.key("ObjFlags", format_args!("0x{:X}", entry.flags))?;
        }
        // CiA 306 has no such key for a domain, because no PDO carries one. The package canopen of npm refuses the key
        // there.
        if entry.object_type == DOMAIN {
            return Ok(());
        }
        self.key("PDOMapping", u8::from(entry.is_mappable))
    }
}

/// The list of an object: mandatory for every device (CiA 301), manufacturer-specific, or neither.
const fn list_of(index: u16) -> &'static str {
    match index {
        0x1000 | 0x1001 | 0x1018 => "MandatoryObjects",
        0x2000..=0x5FFF => "ManufacturerObjects",
        _ => "OptionalObjects",
    }
}
