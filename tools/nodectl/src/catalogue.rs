//! Names, types and units of the objects of a node, from a data sheet.

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{DEVICES, DataType, Device, DeviceInfo, Eds, Entry, LookupError};

use crate::object::Place;
use crate::unit;
use crate::value::Value;

/// The first index after the communication profile. The communication profile is equal in all devices (CiA 301).
const FIRST_OF_VENDOR: u16 = 0x2000;

/// The data sheet of a device, and the communication profile. The profile serves for objects that the data sheet lacks,
/// and for devices without a data sheet.
#[derive(Clone, Debug)]
pub struct Catalogue {
    sheet: Eds,
    common: Eds,
    /// Whether the sheet is that of a device, not only the communication profile.
    is_of_a_device: bool,
}

impl Catalogue {
    /// The catalogue of a device with a data sheet. A data sheet file has no place for units (CiA 306): the units of a
    /// device of this project come from the built-in data sheet.
    #[must_use]
    pub fn new(mut sheet: Eds) -> Catalogue {
        let DeviceInfo { vendor_number, product_number, .. } = sheet.device;
        if let Some(own) = built_in(vendor_number, product_number).map(Device::eds) {
            let entries = sheet.objects.values_mut().flat_map(|object| object.entries.values_mut());
            for entry in entries.filter(|entry| entry.unit.is_empty()) {
                entry.unit = own.get(entry.index, entry.sub).map_or_else(String::new, |own| own.unit.clone());
            }
        }
        Catalogue { sheet, common: common(), is_of_a_device: true }
    }

    /// The catalogue of an unknown device.
    #[must_use]
    pub fn unknown() -> Catalogue {
        Catalogue { sheet: common(), common: common(), is_of_a_device: false }
    }

    /// The data sheet of a device of this project with this identity (1018h:1 and 2).
    #[must_use]
    pub fn built_in(vendor: u32, product: u32) -> Option<Catalogue> {
        built_in(vendor, product).map(|device| Catalogue::new(device.eds().clone()))
    }

    /// The data sheet of a device of this project, by its file name.
    #[must_use]
    pub fn of_file(name: &str) -> Option<Catalogue> {
        DEVICES
            .iter()
            .find(|device| device.file_name == name)
            .map(|device| Catalogue::new(device.eds().clone()))
    }

    /// The object that a person means, by address or by name. Any address is accepted, also one that no data sheet has.
    ///
    /// # Errors
    /// When no object has the name, or more than one.
    pub fn find(&self, query: &str) -> Result<Multiplexer, LookupError> {
        match self.sheet.find(query) {
            Ok(entry) => Ok(Multiplexer { index: entry.index, sub: entry.sub }),
            Err(LookupError::Address(at)) => Ok(at),
            Err(error) => Err(error),
        }
    }

    /// Whether there is a data sheet of the device, not only the communication profile.
    #[must_use]
    pub fn is_of_a_device(&self) -> bool {
        self.is_of_a_device
    }

    /// Whether the device is one of this project.
    #[must_use]
    pub fn is_of_this_project(&self) -> bool {
        let DeviceInfo { vendor_number, product_number, .. } = self.sheet.device;
        self.is_of_a_device && built_in(vendor_number, product_number).is_some()
    }

    /// The objects of the data sheet; none without a data sheet of the device.
    pub fn indices(&self) -> impl Iterator<Item = u16> {
        self.sheet.objects.keys().copied().filter(|_| self.is_of_a_device())
    }

    /// The data sheet.
    #[must_use]
    pub fn sheet(&self) -> &Eds {
        &self.sheet
    }

    /// The entry of an object.
    #[must_use]
    pub fn entry(&self, at: Multiplexer) -> Option<&Entry> {
        self.sheet.get(at.index, at.sub).or_else(|| self.common.get(at.index, at.sub))
    }

    /// The name of an object with the name of its record: `Identity/Vendor-ID`.
    #[must_use]
    pub fn name(&self, at: Multiplexer) -> Option<String> {
        let of = |eds: &Eds| eds.get(at.index, at.sub).map(|entry| eds.path(entry));
        of(&self.sheet).or_else(|| of(&self.common))
    }

    /// The values that an object accepts, where the data sheet narrows the range of the type: `0 to 240`.
    #[must_use]
    pub fn range(&self, at: Multiplexer, node: NodeId) -> Option<String> {
        let entry = self.entry(at)?;
        let text = |formula: &Option<eds::Formula>| match formula.as_ref()?.evaluate(node) {
            eds::Value::Integer(value) => Some(value.to_string()),
            eds::Value::Real(value) => Some(value.to_string()),
            eds::Value::Text(_) => None,
        };
        match (text(&entry.low), text(&entry.high)) {
            (Some(low), Some(high)) => Some(format!("{low} to {high}")),
            (Some(low), None) => Some(format!("{low} and more")),
            (None, Some(high)) => Some(format!("up to {high}")),
            (None, None) => None,
        }
    }

    /// The number for a word that a person types for an object: the symbol of a unit (`mbar`), or a signature (`save`,
    /// `zero`) for an object of four bytes. `None` for any other text.
    #[must_use]
    pub fn word(&self, at: Multiplexer, text: &str) -> Option<Value> {
        const SIGNATURES: [&str; 6] = ["save", "load", "zero", "tare", "cali", "fact"];
        let entry = self.entry(at).filter(|entry| entry.data_type == DataType(0x07))?;
        if takes_unit(entry) {
            return unit::code(text).map(|code| Value::Integer(code.into()));
        }
        let letters: [u8; 4] = SIGNATURES.contains(&text).then(|| text.as_bytes().try_into().ok())??;
        Some(Value::Integer(u32::from_le_bytes(letters).into()))
    }

    /// The words that an object accepts besides numbers, for the end of an error: `, or the word save`. Empty for most.
    #[must_use]
    pub fn words(&self, at: Multiplexer) -> String {
        const SIGNED: [(u16, &str); 4] =
            [(0x1010, "save"), (0x1011, "load"), (0x6125, "zero"), (0x6139, "tare")];
        if self.entry(at).is_some_and(takes_unit) {
            return ", or a unit, such as kPa, mbar or psi".to_owned();
        }
        // In a module of two devices, the second one is 800h higher.
        let word = SIGNED.iter().find(|(index, _)| at.index == *index || at.index == index | 0x0800);
        word.filter(|_| at.sub > 0).map(|(_, word)| format!(", or the word {word}")).unwrap_or_default()
    }

    /// Why there is no type for an object: the data sheet has the index without this sub-index, or not at all.
    #[must_use]
    pub fn missing(&self, at: Multiplexer) -> String {
        let object = self.sheet.objects.get(&at.index).or_else(|| self.common.objects.get(&at.index));
        let Some(object) = object else {
            return format!("no data sheet states the type of {}", Place(at));
        };
        let has = match object.entries.keys().last() {
            Some(highest) if object.object_type.has_subs() => format!("its highest sub-index is {highest}"),
            _ => format!("the object has one value, {:04X}h", at.index),
        };
        format!("the data sheet has no {}: {has}", Place(at))
    }

    /// Whether an object accepts a value, by the limits of the data sheet.
    #[must_use]
    pub fn allows(&self, at: Multiplexer, node: NodeId, value: &Value) -> bool {
        let Some((entry, value)) = self.entry(at).zip(value.as_f64()) else { return true };
        let limit = |formula: &Option<eds::Formula>| match formula.as_ref()?.evaluate(node) {
            #[allow(clippy::cast_precision_loss)] // Integers with limits have 32 bits.
            eds::Value::Integer(value) => Some(value as f64),
            eds::Value::Real(value) => Some(value),
            eds::Value::Text(_) => None,
        };
        !limit(&entry.low).is_some_and(|low| value < low)
            && !limit(&entry.high).is_some_and(|high| value > high)
    }

    /// The device type in the data sheet (default of 1000h).
    #[must_use]
    pub fn device_type(&self) -> Option<u32> {
        match self.sheet.get(0x1000, 0)?.default {
            Some(eds::Formula::Constant(eds::Value::Integer(value))) => u32::try_from(value).ok(),
            _ => None,
        }
    }

    /// All entries of the data sheet; without one, the entries of the communication profile.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.sheet.entries()
    }

    /// The name of a device of this project, by its identity (1018h:1 and 2): `pressure`, `encoder` ...
    #[must_use]
    pub fn device_name(vendor: u32, product: u32) -> Option<String> {
        built_in(vendor, product).map(|device| device.file_name.trim_end_matches(".eds").to_owned())
    }

    /// All readable entries of a record or an array; none where the object is unknown.
    #[must_use]
    pub fn subs(&self, index: u16) -> Vec<Multiplexer> {
        let object = self.sheet.objects.get(&index).or_else(|| self.common.objects.get(&index));
        let entries = object
            .into_iter()
            .filter(|object| object.object_type.has_subs())
            .flat_map(|object| object.entries.values());
        let readable = entries.filter(|entry| entry.access.is_readable());
        readable.map(|entry| Multiplexer { index, sub: entry.sub }).collect()
    }

    /// The data type of an object.
    #[must_use]
    pub fn data_type(&self, at: Multiplexer) -> Option<DataType> {
        self.entry(at).map(|entry| entry.data_type)
    }

    /// The physical unit of an object; empty where none is known.
    #[must_use]
    pub fn unit(&self, at: Multiplexer) -> &str {
        self.entry(at).map_or("", |entry| &entry.unit)
    }
}

/// Whether the value of an entry is the code of a unit (CiA 303-2).
fn takes_unit(entry: &Entry) -> bool {
    entry.name.to_lowercase().contains("physical unit")
}

fn built_in(vendor: u32, product: u32) -> Option<&'static Device> {
    let is_it = |info: &DeviceInfo| (info.vendor_number, info.product_number) == (vendor, product);
    DEVICES.iter().find(|device| is_it(&device.eds().device))
}

fn common() -> Eds {
    let mut eds = DEVICES.first().map(|device| device.eds().clone()).unwrap_or_default();
    eds.objects.retain(|&index, _| index < FIRST_OF_VENDOR);
    // The objects are the profile of every device, so the sheet names no device.
    eds.device = DeviceInfo::default();
    eds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::at;

    #[test]
    fn the_devices_of_the_project_are_known() {
        let pressure =
            Catalogue::built_in(profiles::product::VENDOR_ID, 1).expect("the pressure transmitter");
        assert_eq!(pressure.find("Pressure process value"), Ok(at(0x6130, 1)));
        assert_eq!(pressure.data_type(at(0x6130, 1)), Some(DataType(0x08)));
        assert!(Catalogue::built_in(0xFFFF_FFFF, 1).is_none());
    }

    #[test]
    fn the_communication_profile_is_known_of_every_device() {
        let unknown = Catalogue::unknown();
        assert_eq!(unknown.find("producer heartbeat time"), Ok(at(0x1017, 0)));
        assert_eq!(unknown.name(at(0x1018, 1)).as_deref(), Some("Identity/Vendor-ID"));
        assert_eq!(unknown.unit(at(0x1017, 0)), "ms");
        assert_eq!(unknown.find("6130:1"), Ok(at(0x6130, 1)));
        assert_eq!(unknown.name(at(0x6130, 1)), None);
        assert!(unknown.find("Pressure process value").is_err());
    }
}
