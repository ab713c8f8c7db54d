//! Reader of data sheets: from text to [`Eds`], by CiA 306 and with the deviations of vendors.

use std::collections::BTreeMap;

use canopen::eds::BIT_RATES;

use crate::ini::{Ini, Section};
use crate::value::{expected, repaired};
use crate::{
    Access, Commissioning, DataType, DeviceInfo, Eds, Entry, Error, Flags, Formula, Object, ObjectType,
    Problem, compact, gaps,
};

/// The keys of the bit rates, in their order.
const RATE_KEYS: [&str; BIT_RATES.len()] = [
    "BaudRate_10",
    "BaudRate_20",
    "BaudRate_50",
    "BaudRate_125",
    "BaudRate_250",
    "BaudRate_500",
    "BaudRate_800",
    "BaudRate_1000",
];

/// Smaller indices are data types, which some editors write as objects.
pub(crate) const FIRST_OBJECT: u16 = 0x1000;

impl Eds {
    /// Reads a data sheet (EDS) or a configuration file (DCF) of any vendor.
    ///
    /// Mistakes in sections and keys are [warnings](Eds::warnings): a missing name is replaced by the address, a missing
    /// or unknown type by DOMAIN, a missing or unknown access by `ro`; a wrong value is left out,
    /// or read up to its mistake (`0.0f`, `12UL`, `5 // off`). Unknown sections and keys are ignored.
    ///
    /// # Errors
    /// The text is not made of sections and keys.
    pub fn parse(text: &str) -> Result<Eds, Error> {
        let ini = Ini::parse(text)?;
        let device = ini.section("deviceinfo").map(device_info).unwrap_or_default();
        let mut objects = BTreeMap::new();
        for section in ini.sections() {
            if let Some((index, None)) = address(section.name()) {
                objects.insert(index, object(&ini, section, index));
            }
        }
        for section in ini.sections() {
            if let Some((index, Some(sub))) = address(section.name()) {
                let object = objects.entry(index).or_insert_with(|| orphanage(section, index));
                object.entries.insert(sub, entry(section, index, sub));
            }
        }
        gaps::warn(&ini, &objects);
        // CiA 306 spells this name with one m; some vendors write two.
        let commissioning = ini.section("devicecomissioning").or_else(|| ini.section("devicecommissioning"));
        let commissioning = commissioning.map(self::commissioning);
        let mut eds = Eds { device, objects, commissioning, warnings: ini.into_warnings() };
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
pub(crate) fn address(section: &str) -> Option<(u16, Option<u8>)> {
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

fn device_info(section: Section) -> DeviceInfo {
    let text = |key| section.get(key).unwrap_or_default().to_owned();
    let rates =
        BIT_RATES.into_iter().zip(RATE_KEYS).filter(|(_, key)| flag(section, key)).map(|(rate, _)| rate);
    DeviceInfo {
        vendor_name: text("VendorName"),
        vendor_number: section.number("VendorNumber"),
        product_name: text("ProductName"),
        product_number: section.number("ProductNumber"),
        revision_number: section.number("RevisionNumber"),
        order_code: text("OrderCode"),
        bit_rates: rates.collect(),
        granularity: section.number("Granularity"),
        group_messaging: flag(section, "GroupMessaging"),
        rpdos: section.number("NrOfRXPDO"),
        tpdos: section.number("NrOfTXPDO"),
        lss: flag(section, "LSS_Supported"),
    }
}

fn commissioning(section: Section) -> Commissioning {
    Commissioning {
        node_id: section.number("NodeID"),
        bit_rate: Some(section.number("Baudrate")).filter(|rate| *rate != 0),
        serial: section.number("LSS_SerialNumber"),
    }
}

fn flag(section: Section, key: &'static str) -> bool {
    section.number::<u8>(key) != 0
}

fn object(ini: &Ini, section: Section, index: u16) -> Object {
    let name = name(section, index, None);
    let object_type = object_type(section);
    let entries = match section.number("CompactSubObj") {
        0 if object_type.has_subs() => BTreeMap::new(),
        0 => BTreeMap::from([(0, entry(section, index, 0))]),
        count => compact::entries(ini, &entry(section, index, 0), count),
    };
    Object { index, name, object_type, entries }
}

/// The record of a sub-index whose index has no section.
fn orphanage(section: Section, index: u16) -> Object {
    section.warn("", Problem::Orphan);
    let name = format!("{index:04X}h");
    Object { index, name, object_type: ObjectType::Record, entries: BTreeMap::new() }
}

fn name(section: Section, index: u16, sub: Option<u8>) -> String {
    let address = || sub.map_or_else(|| format!("{index:04X}h"), |sub| format!("{index:04X}h:{sub}"));
    section.required("ParameterName").map_or_else(address, str::to_owned)
}

/// An object without an object type is a variable (CiA 306); if the object counts sub-indices, a record.
fn object_type(section: Section) -> ObjectType {
    let by_content = || {
        let has_subs = section.number::<u8>("SubNumber") != 0;
        if has_subs { ObjectType::Record } else { ObjectType::Var }
    };
    let Some(text) = section.get("ObjectType") else { return by_content() };
    ObjectType::from_code(section.number("ObjectType")).unwrap_or_else(|| {
        let expected = "a variable (0x7), an array (0x8), a record (0x9) or a domain (0x2)";
        section.wrong("ObjectType", text, expected);
        by_content()
    })
}

fn entry(section: Section, index: u16, sub: u8) -> Entry {
    let data_type = data_type(section);
    let is_of_object = !section.name().contains("sub");
    let value = formula(section, "ParameterValue", data_type);
    // Without the value that its author meant, an entry has none: the default would be another one.
    let is_damaged = value.is_none() && section.get("ParameterValue").is_some();
    Entry {
        index,
        sub,
        name: name(section, index, (!is_of_object).then_some(sub)),
        data_type,
        access: access(section),
        default: formula(section, "DefaultValue", data_type).filter(|_| !is_damaged),
        value,
        low: formula(section, "LowLimit", data_type),
        high: formula(section, "HighLimit", data_type),
        mappable: flag(section, "PDOMapping"),
        flags: Some(Flags(section.number("ObjFlags"))),
        unit: String::new(),
    }
}

/// The data type of a section. A domain may leave it out.
fn data_type(section: Section) -> DataType {
    if section.get("DataType").is_none() && object_type(section) == ObjectType::Domain {
        return DataType::DOMAIN;
    }
    match section.required("DataType").map(|_| section.number("DataType")) {
        None | Some(0) => DataType::DOMAIN,
        Some(code) => DataType(code),
    }
}

fn access(section: Section) -> Access {
    let Some(text) = section.required("AccessType") else { return Access::ReadOnly };
    Access::from_text(text).unwrap_or_else(|| {
        section.wrong("AccessType", text, "one of ro, wo, rw, rwr, rww and const");
        if text.eq_ignore_ascii_case("w") { Access::WriteOnly } else { Access::ReadOnly }
    })
}

fn formula(section: Section, key: &'static str, data_type: DataType) -> Option<Formula> {
    value(section, key, section.get(key)?, data_type)
}

/// The value of a key, or of a numbered line, by its data type.
pub(crate) fn value(section: Section, key: &'static str, text: &str, data_type: DataType) -> Option<Formula> {
    let read = |text: &str| Formula::parse(text, data_type);
    read(text).or_else(|| {
        let (value, text, expected) = (repaired(text, read), text.to_owned(), expected(data_type));
        let is_read = value.is_some();
        section.warn(
            key,
            if is_read { Problem::Value { text, expected } } else { Problem::NoValue { text, expected } },
        );
        value
    })
}
