//! Reader of data sheets: from text to [`Eds`], by CiA 306 and with the deviations of vendors.

use std::collections::{BTreeMap, BTreeSet};

use crate::ini::{Ini, Section};
use crate::{
    Access, Commissioning, DataType, DeviceInfo, Eds, Entry, Error, Flags, Formula, Object, ObjectType,
    Problem, compact,
};

/// The bit rates in kbit/s and their keys in a data sheet.
pub(crate) const BIT_RATES: [(u16, &str); 8] = [
    (10, "BaudRate_10"),
    (20, "BaudRate_20"),
    (50, "BaudRate_50"),
    (125, "BaudRate_125"),
    (250, "BaudRate_250"),
    (500, "BaudRate_500"),
    (800, "BaudRate_800"),
    (1000, "BaudRate_1000"),
];

/// Smaller indices are data types, which some editors write as objects.
const FIRST_OBJECT: u16 = 0x1000;

impl Eds {
    /// Reads a data sheet (EDS) or a configuration file (DCF) of any vendor.
    ///
    /// A missing required key of an object or a wrong value is an error. Unknown sections and keys are ignored.
    ///
    /// # Errors
    /// The first thing in the file that is wrong, with its section, its key and its line.
    pub fn parse(text: &str) -> Result<Eds, Error> {
        let ini = Ini::parse(text)?;
        let device = ini.section("deviceinfo").map(device_info).transpose()?.unwrap_or_default();
        let mut objects = BTreeMap::new();
        for section in ini.sections() {
            if let Some((index, None)) = address(section.name()) {
                objects.insert(index, object(&ini, section, index)?);
            }
        }
        for section in ini.sections() {
            if let Some((index, Some(sub))) = address(section.name()) {
                let object = objects.get_mut(&index).ok_or_else(|| section.error("", Problem::Orphan))?;
                object.entries.insert(sub, entry(section, index, sub)?);
            }
        }
        // CiA 306 spells this name with one m; some vendors write two.
        let commissioning = ini.section("devicecomissioning").or_else(|| ini.section("devicecommissioning"));
        let commissioning = commissioning.map(self::commissioning).transpose()?;
        let mut eds = Eds { device, objects, commissioning };
        eds.drop_unused_flags();
        Ok(eds)
    }

    /// Calls [`Eds::parse`] for a file in UTF-8 or in Latin-1, which older editors write.
    ///
    /// # Errors
    /// The errors of [`Eds::parse`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Eds, Error> {
        match std::str::from_utf8(bytes) {
            Ok(text) => Eds::parse(text),
            Err(_) => Eds::parse(&bytes.iter().copied().map(char::from).collect::<String>()),
        }
    }
}

/// The index of `[1018]`; the index and sub-index of `[1018sub1]`.
fn address(section: &str) -> Option<(u16, Option<u8>)> {
    let hex = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let (index, sub) = section.split_once("sub").map_or((section, None), |(index, sub)| (index, Some(sub)));
    if index.len() != 4 || !hex(index) || !sub.is_none_or(hex) {
        return None;
    }
    let index = u16::from_str_radix(index, 16).ok().filter(|&index| index >= FIRST_OBJECT)?;
    match sub {
        None => Some((index, None)),
        Some(sub) => Some((index, Some(u8::from_str_radix(sub, 16).ok()?))),
    }
}

fn device_info(section: Section) -> Result<DeviceInfo, Error> {
    let text = |key| section.get(key).unwrap_or_default().to_owned();
    let mut bit_rates = BTreeSet::new();
    for (rate, key) in BIT_RATES {
        if flag(section, key)? {
            bit_rates.insert(rate);
        }
    }
    Ok(DeviceInfo {
        vendor_name: text("VendorName"),
        vendor_number: section.number("VendorNumber")?,
        product_name: text("ProductName"),
        product_number: section.number("ProductNumber")?,
        revision_number: section.number("RevisionNumber")?,
        order_code: text("OrderCode"),
        bit_rates,
        granularity: section.number("Granularity")?,
        group_messaging: flag(section, "GroupMessaging")?,
        rpdos: section.number("NrOfRXPDO")?,
        tpdos: section.number("NrOfTXPDO")?,
        lss: flag(section, "LSS_Supported")?,
    })
}

fn commissioning(section: Section) -> Result<Commissioning, Error> {
    Ok(Commissioning {
        node_id: section.number("NodeID")?,
        bit_rate: section.number("Baudrate")?,
        serial: section.number("LSS_SerialNumber")?,
    })
}

fn flag(section: Section, key: &'static str) -> Result<bool, Error> {
    section.number::<u8>(key).map(|value| value != 0)
}

fn object(ini: &Ini, section: Section, index: u16) -> Result<Object, Error> {
    let name = section.required("ParameterName")?.to_owned();
    let object_type = object_type(section)?;
    let entries = match section.number("CompactSubObj")? {
        0 if object_type.has_subs() => BTreeMap::new(),
        0 => BTreeMap::from([(0, entry(section, index, 0)?)]),
        count => compact::entries(ini, &entry(section, index, 0)?, count)?,
    };
    Ok(Object { index, name, object_type, entries })
}

/// An object without an object type is a variable (CiA 306); if the object counts sub-indices, a record.
fn object_type(section: Section) -> Result<ObjectType, Error> {
    let Some(text) = section.get("ObjectType") else {
        let has_subs = section.number::<u8>("SubNumber")? != 0;
        return Ok(if has_subs { ObjectType::Record } else { ObjectType::Var });
    };
    let code = section.number("ObjectType")?;
    ObjectType::from_code(code).ok_or_else(|| {
        section.wrong(
            "ObjectType",
            text,
            "a variable (0x7), an array (0x8), a record (0x9) or a domain (0x2)",
        )
    })
}

fn entry(section: Section, index: u16, sub: u8) -> Result<Entry, Error> {
    let data_type = data_type(section)?;
    Ok(Entry {
        index,
        sub,
        name: section.required("ParameterName")?.to_owned(),
        data_type,
        access: access(section)?,
        default: formula(section, "DefaultValue", data_type)?,
        value: formula(section, "ParameterValue", data_type)?,
        low: formula(section, "LowLimit", data_type)?,
        high: formula(section, "HighLimit", data_type)?,
        mappable: flag(section, "PDOMapping")?,
        // A mistake in the flags is no reason to refuse the file.
        flags: Some(Flags(section.number("ObjFlags").unwrap_or_default())),
        unit: String::new(),
    })
}

/// The data type of a section. A domain may leave it out.
fn data_type(section: Section) -> Result<DataType, Error> {
    if section.get("DataType").is_none() && object_type(section)? == ObjectType::Domain {
        return Ok(DataType::DOMAIN);
    }
    section.required("DataType")?;
    section.number("DataType").map(DataType)
}

fn access(section: Section) -> Result<Access, Error> {
    let text = section.required("AccessType")?;
    let expected = "one of ro, wo, rw, rwr, rww and const";
    Access::from_text(text).ok_or_else(|| section.wrong("AccessType", text, expected))
}

fn formula(section: Section, key: &'static str, data_type: DataType) -> Result<Option<Formula>, Error> {
    section.get(key).map(|text| value(section, key, text, data_type)).transpose()
}

/// The value of a key, or of a numbered line, by its data type.
pub(crate) fn value(
    section: Section,
    key: &'static str,
    text: &str,
    data_type: DataType,
) -> Result<Formula, Error> {
    Formula::parse(text, data_type).ok_or_else(|| section.wrong(key, text, format!("a value of {data_type}")))
}
