//! The text of a data sheet: from the dictionary table of a device, and from [`Eds`] (CiA 306). The form is that of
//! [`canopen::eds`]. The text is the same on every run.

use std::fmt;
use std::sync::OnceLock;

use canopen::dictionary::{DefaultValue, Object as Row};
use canopen::eds::{self, BIT_RATES, DeviceKeys, EntryKeys, Writer};
use profiles::Personality;
use profiles::product::{REVISION, VENDOR_ID};

use crate::{Device, DeviceInfo, Edition, Eds, Entry, Flags, Object, Reals};

/// Day of the first release, month first (CiA 306).
const CREATION_DATE: &str = "11-21-2026";
const TIME: &str = "12:00AM";
const AUTHOR: &str = "cargo xtask eds";
/// Vendor and order code. CiA has assigned no vendor-ID to the project, and the keys must not be empty.
const NONE: &str = "none";

const COMMENTS: [&str; 2] = [
    "Generated from the dictionary table of the firmware by cargo xtask eds. Do not edit.",
    "The comment above a section is the physical unit; an index there is the object that selects the unit.",
];

impl Device {
    /// The text of the data sheet in an edition.
    #[must_use]
    pub fn sheet(&self, edition: &Edition) -> String {
        let mut info = eds::DeviceInfo::new(NONE, self.product_name());
        (info.order_code, info.description, info.file_name) = (NONE, self.description, self.file_name);
        (info.author, info.comments, info.reals) = (AUTHOR, &COMMENTS, Reals::Bits);
        (info.file_version, info.file_revision) = ((REVISION >> 16) as u16, edition.revision);
        info.created = Some((CREATION_DATE, TIME));
        info.modified = Some((&edition.date, TIME));
        let rows: Vec<Row> = self.rows.iter().map(|row| self.identified(*row)).collect();
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = eds::write(&rows, &info, &mut text);
        text
    }

    /// The data sheet as a value, with the units, which the text has in comments. The text is read once.
    #[must_use]
    pub fn eds(&self) -> &'static Eds {
        static READ: [OnceLock<Eds>; Personality::ALL.len()] =
            [const { OnceLock::new() }; Personality::ALL.len()];
        READ[usize::from(self.personality.number())].get_or_init(|| self.read())
    }

    fn read(&self) -> Eds {
        let mut eds = Eds::parse(&self.sheet(&Edition::default())).unwrap_or_default();
        for row in self.rows {
            let object = eds.objects.get_mut(&row.index);
            if let Some(entry) = object.and_then(|object| object.entries.get_mut(&row.sub)) {
                entry.unit = row.unit.into();
            }
        }
        eds
    }

    /// The rows of each object.
    pub(crate) fn objects(&self) -> impl Iterator<Item = &'static [Row]> {
        self.rows.chunk_by(|row, next| row.index == next.index)
    }

    /// Object 1008h.
    fn product_name(&self) -> &'static str {
        match self.rows.iter().find(|row| row.index == 0x1008).map(|row| row.default) {
            Some(DefaultValue::Text(name)) => name,
            _ => self.description,
        }
    }

    /// The row with its default. The table has no identity, because the node itself fills it in. The serial number
    /// differs in each device, and the identification of the program in each version.
    fn identified(&self, mut row: Row) -> Row {
        let number = |value: u32| DefaultValue::Integer(value.into());
        row.default = match (row.index, row.sub) {
            (0x1018, 1) => number(VENDOR_ID),
            (0x1018, 2) => number(self.personality.product_code()),
            (0x1018, 3) => number(REVISION),
            (0x1018, 4) | (0x1F56, 1) => DefaultValue::None,
            _ => row.default,
        };
        row
    }
}

impl DeviceInfo {
    pub(crate) fn write(&self, out: &mut Writer<'_, String>) -> fmt::Result {
        let rates: Vec<u16> = BIT_RATES.into_iter().filter(|rate| self.bit_rates.contains(rate)).collect();
        out.device(&DeviceKeys {
            vendor: &self.vendor_name,
            vendor_id: self.vendor_number,
            product: &self.product_name,
            product_code: self.product_number,
            revision: self.revision_number,
            order_code: &self.order_code,
            bit_rates: &rates,
            granularity: self.granularity,
            has_multiplexed_pdos: self.group_messaging,
            rpdos: self.rpdos,
            tpdos: self.tpdos,
            has_lss: self.lss,
        })
    }
}

impl Eds {
    /// The lists and the objects. `reals` is the form of real numbers that are the value of a parameter.
    pub(crate) fn write_objects(&self, reals: Reals, out: &mut Writer<'_, String>) -> fmt::Result {
        out.dummies()?;
        out.objects(&self.objects.values(), |object| object.index, |out, object| object.write(reals, out))
    }
}

impl Object {
    fn write(&self, reals: Reals, out: &mut Writer<'_, String>) -> fmt::Result {
        let has_subs = self.object_type.has_subs();
        if has_subs {
            out.object(self.index, &self.name, self.object_type.code(), self.entries.len())?;
        }
        self.entries.values().try_for_each(|entry| entry.write(has_subs.then_some(entry.sub), reals, out))
    }
}

impl Entry {
    fn write(&self, sub: Option<u8>, reals: Reals, out: &mut Writer<'_, String>) -> fmt::Result {
        let values = [
            ("DefaultValue", &self.default, Reals::Bits),
            ("ParameterValue", &self.value, reals),
            ("LowLimit", &self.low, Reals::Bits),
            ("HighLimit", &self.high, Reals::Bits),
        ];
        let text = |(key, value, reals): (_, &Option<crate::Formula>, _)| {
            Some((key, value.as_ref()?.text(self.data_type, reals)))
        };
        let values: Vec<(&str, String)> = values.into_iter().filter_map(text).collect();
        let values: Vec<(&str, &dyn fmt::Display)> =
            values.iter().map(|(key, value)| (*key, value as &dyn fmt::Display)).collect();
        out.entry(&EntryKeys {
            index: self.index,
            sub,
            unit: &self.unit,
            name: &self.name,
            object_type: self.object_type().code(),
            data_type: self.data_type.0,
            access: self.access.text(),
            values: &values,
            flags: self.flags.unwrap_or(Flags(0)).0,
            is_mappable: self.mappable,
        })
    }
}
