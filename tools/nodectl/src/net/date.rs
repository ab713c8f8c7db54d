//! The date of a configuration: 1020h (CiA 301, 7.5.2.22).

use std::fmt;
use std::str::FromStr;

use chrono::{Datelike as _, Days, NaiveDate, NaiveTime, Timelike as _};
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// Days and milliseconds as 1020h:1 and 1020h:2 have them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema)]
#[schemars(with = "String")]
pub struct Date {
    /// Days since 1984-01-01.
    pub days: u32,
    /// Milliseconds after midnight.
    pub milliseconds: u32,
}

/// The day with the number 0.
const EPOCH: NaiveDate = NaiveDate::from_ymd_opt(1984, 1, 1).expect("a date");
const MINUTE: u32 = 60_000;

impl FromStr for Date {
    type Err = String;

    /// `2026-11-24`, or `2026-11-24 10:30`.
    fn from_str(text: &str) -> Result<Date, String> {
        let (day, time) = text.split_once([' ', 'T']).unwrap_or((text, "00:00"));
        let found = days(day).zip(minutes(time));
        found
            .map(|(days, minutes)| Date { days, milliseconds: minutes * MINUTE })
            .ok_or_else(|| format!("\"{text}\" is no date such as 2026-11-24 10:30, from 1984-01-01 on"))
    }
}

fn days(text: &str) -> Option<u32> {
    let day = NaiveDate::parse_from_str(text, "%Y-%m-%d").ok().filter(|day| day.year() < 10_000)?;
    u32::try_from(day.signed_duration_since(EPOCH).num_days()).ok()
}

fn minutes(text: &str) -> Option<u32> {
    let time = NaiveTime::parse_from_str(text, "%H:%M").ok()?;
    Some(time.hour() * 60 + time.minute())
}

/// `2026-11-24 10:30`
impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let minutes = self.milliseconds / MINUTE;
        match EPOCH.checked_add_days(Days::new(self.days.into())) {
            Some(day) => write!(f, "{} {:02}:{:02}", day.format("%Y-%m-%d"), minutes / 60, minutes % 60),
            // A device can have any number.
            None => write!(f, "{} days after 1984-01-01", self.days),
        }
    }
}

impl<'de> Deserialize<'de> for Date {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Date, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_from_1984() {
        for (text, days, milliseconds) in [
            ("1984-01-01", 0, 0),
            ("1984-02-29", 59, 0),
            ("1984-12-31T23:59", 365, 86_340_000),
            ("2000-02-29 00:01", 5903, 60_000),
            ("2026-11-24 10:30", 15_668, 37_800_000),
        ] {
            let date: Date = text.parse().unwrap();
            assert_eq!(date, Date { days, milliseconds }, "{text}");
            assert!(date.to_string().starts_with(&text[..10]), "{date}");
        }
        for days in 0..60_000 {
            let date = Date { days, milliseconds: 3_600_000 };
            assert_eq!(date.to_string().parse(), Ok(date));
        }
    }

    #[test]
    fn no_date_is_refused() {
        for text in
            ["", "1983-12-31", "2026-02-29", "2026-04-31", "2026-13-01", "2026-01-01 24:00", "24.11.2026"]
        {
            assert!(text.parse::<Date>().is_err(), "{text}");
        }
    }
}
