//! Editions of a data sheet: a sheet with other objects gets another revision and date.
//!
//! The file in the tree is the record: a sheet that differs in its edition only keeps the edition of the file.

use std::time::SystemTime;

use chrono::{DateTime, Utc};

use crate::Device;

/// The edition of a data sheet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Edition {
    /// Key `FileRevision`, 0 to 255.
    pub revision: u8,
    /// Key `ModificationDate`, month first (CiA 306).
    pub date: String,
}

impl Edition {
    /// The edition of the data sheet of a device, after the text of the file in the tree: that of the file where
    /// nothing else has changed, else the next one, of today.
    #[must_use]
    pub fn after(file: &str, device: &Device) -> Edition {
        let Some(of_file) = Edition::of(file) else { return Edition { revision: 0, date: today() } };
        if device.sheet(&of_file) == file {
            return of_file;
        }
        Edition { revision: of_file.revision.wrapping_add(1), date: today() }
    }

    /// The edition in the text of a data sheet.
    fn of(file: &str) -> Option<Edition> {
        let value = |key: &str| file.lines().find_map(|line| line.trim_end().strip_prefix(key));
        let (revision, date) = (value("FileRevision=")?, value("ModificationDate=")?);
        Some(Edition { revision: revision.parse().ok()?, date: date.to_owned() })
    }
}

/// The present day (UTC) as CiA 306 writes it.
fn today() -> String {
    date(SystemTime::now().into())
}

fn date(day: DateTime<Utc>) -> String {
    day.format("%m-%d-%Y").to_string()
}

#[cfg(test)]
mod tests {
    use chrono::Days;

    use super::*;
    use crate::DEVICES;

    #[test]
    fn days_in_the_calendar() {
        for (days, text) in
            [(0, "01-01-1970"), (11_016, "02-29-2000"), (20_512, "02-28-2026"), (20_782, "11-25-2026")]
        {
            assert_eq!(date(DateTime::UNIX_EPOCH + Days::new(days)), text);
        }
    }

    #[test]
    fn a_changed_sheet_gets_the_next_revision_of_today_and_an_equal_one_keeps_its_edition() {
        for device in &DEVICES {
            let edition = Edition { revision: 7, date: "01-02-2003".to_owned() };
            let sheet = device.sheet(&edition);
            assert_eq!(Edition::after(&sheet, device), edition, "{}", device.file_name);
            let other = sheet.replace("[1017]", "[1018]");
            assert_eq!(Edition::after(&other, device), Edition { revision: 8, date: today() });
            assert_eq!(Edition::after("", device).revision, 0);
        }
    }
}
