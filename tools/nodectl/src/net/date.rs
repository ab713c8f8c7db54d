//! The date of a configuration: 1020h (CiA 301, 7.5.2.22).

use std::fmt;
use std::str::FromStr;

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

/// Days from 0000-03-01 to 1984-01-01.
const EPOCH: i64 = 724_581;
const MINUTE: u32 = 60_000;

impl FromStr for Date {
    type Err = String;

    /// `2026-11-24`, or `2026-11-24 10:30`.
    fn from_str(text: &str) -> Result<Date, String> {
        let (day, time) = text.split_once([' ', 'T']).unwrap_or((text, "00:00"));
        let date = days(day).zip(minutes(time));
        let found = date.map(|(days, minutes)| Date { days, milliseconds: minutes * MINUTE });
        found.ok_or_else(|| format!("\"{text}\" is no date such as 2026-11-24 10:30, from 1984-01-01 on"))
    }
}

fn days(text: &str) -> Option<u32> {
    let mut parts = text.splitn(3, '-').map(|part| part.parse::<i64>().ok());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    let is_date = (1984..10_000).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let since = day_number(year, month, day);
    let found = is_date.then(|| u32::try_from(since - EPOCH).ok())??;
    // 31 April is 1 May.
    (civil(found) == (year, month, day)).then_some(found)
}

/// Days since 0000-03-01, in years that begin in March.
fn day_number(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1
}

/// Year, month and day.
fn civil(days: u32) -> (i64, i64, i64) {
    let since = i64::from(days) + EPOCH;
    let era = since / 146_097;
    let of_era = since % 146_097;
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let year = era * 400 + year;
    if month < 10 { (year, month + 3, day) } else { (year + 1, month - 9, day) }
}

fn minutes(text: &str) -> Option<u32> {
    let (hour, minute) = text.split_once(':')?;
    let (hour, minute): (u32, u32) = (hour.parse().ok()?, minute.parse().ok()?);
    (hour < 24 && minute < 60).then_some(hour * 60 + minute)
}

/// `2026-11-24 10:30`
impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (year, month, day) = civil(self.days);
        let minutes = self.milliseconds / MINUTE;
        write!(f, "{year:04}-{month:02}-{day:02} {:02}:{:02}", minutes / 60, minutes % 60)
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
