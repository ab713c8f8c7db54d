//! Scripts of a simulated device: lines with a time in seconds and a deed.
//!
//! ```text
//! # seconds  what
//! 0          6130:1 = 1.25
//! 0.5        Pressure process value = 2.5
//! 1          emcy 4200
//! 2          emcy 0
//! 5          repeat
//! ```

use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant};
use thiserror::Error;

use super::node::condition;
use crate::Catalogue;
use crate::object::Place;
use crate::value::Value;

/// The effect of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Deed {
    /// An object gets this value.
    Value(Multiplexer, Vec<u8>),
    /// A fault occurs, by the number of its condition.
    Fault(u8),
    /// All faults are over.
    NoFault,
}

/// The lines of a script in the order of their times.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Script {
    lines: Vec<(Duration, Deed)>,
    /// The time after which the script begins again.
    period: Option<Duration>,
    /// The number of the next line, and the number of periods before.
    place: usize,
    rounds: u64,
}

/// A line that is no line of a script.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {reason}")]
pub struct ScriptError {
    line: usize,
    reason: String,
}

impl Script {
    /// Reads a script. Objects have the names and types of the catalogue.
    ///
    /// # Errors
    /// The first line that is wrong.
    pub fn parse(text: &str, catalogue: &Catalogue) -> Result<Script, ScriptError> {
        let mut script = Script::default();
        for (number, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.is_empty() {
                continue;
            }
            script.add(line, catalogue).map_err(|reason| ScriptError { line: number + 1, reason })?;
        }
        script.lines.sort_by_key(|(time, _)| *time);
        match (script.period, script.lines.last()) {
            (Some(period), Some((last, _))) if *last > period => Err(ScriptError {
                line: text.lines().count(),
                reason: "a line is later than the repetition".to_owned(),
            }),
            _ => Ok(script),
        }
    }

    fn add(&mut self, line: &str, catalogue: &Catalogue) -> Result<(), String> {
        let (time, deed) = line.split_once(char::is_whitespace).ok_or("a time and a value are expected")?;
        let time = seconds(time).ok_or_else(|| format!("\"{time}\" is no time in seconds"))?;
        let deed = deed.trim();
        if deed == "repeat" {
            self.period = Some(time).filter(|time| time.0 > 0);
            return if self.period.is_some() { Ok(()) } else { Err("0 s is no period".to_owned()) };
        }
        let deed = match deed.strip_prefix("emcy") {
            Some(code) => fault(code.trim())?,
            None => value(deed, catalogue)?,
        };
        self.lines.push((time, deed));
        Ok(())
    }

    /// The next deed whose time has come.
    pub(super) fn due(&mut self, now: Instant, begin: Instant) -> Option<Deed> {
        if self.next(begin) > now {
            return None;
        }
        let deed = self.lines.get(self.place)?.1.clone();
        self.place += 1;
        if self.place == self.lines.len() && self.period.is_some() {
            (self.place, self.rounds) = (0, self.rounds + 1);
        }
        Some(deed)
    }

    /// The time of the next line.
    pub(super) fn next(&self, begin: Instant) -> Instant {
        let before = self.period.map_or(0, |period| period.0 * self.rounds);
        self.lines.get(self.place).map_or(Instant::NEVER, |(time, _)| begin + Duration(before + time.0))
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Checked: at most a year.
fn seconds(text: &str) -> Option<Duration> {
    let seconds: f64 = text.parse().ok()?;
    (0.0..3.2e7).contains(&seconds).then_some(Duration((seconds * 1e6).round() as u64))
}

fn fault(code: &str) -> Result<Deed, String> {
    let number = u16::from_str_radix(code, 16).map_err(|_| format!("\"{code}\" is no EMCY code"))?;
    match condition(number) {
        _ if number == 0 => Ok(Deed::NoFault),
        Some(number) => Ok(Deed::Fault(number)),
        None => Err(format!("{number:04X}h is none of the classes of CiA 301, such as 4200")),
    }
}

fn value(deed: &str, catalogue: &Catalogue) -> Result<Deed, String> {
    let (object, value) = deed.split_once('=').ok_or("OBJECT = VALUE, emcy CODE or repeat is expected")?;
    let at = catalogue.find(object.trim()).map_err(|error| error.to_string())?;
    let data_type =
        catalogue.data_type(at).ok_or_else(|| format!("{} is not in the data sheet", Place(at)))?;
    let value = Value::parse(value.trim(), data_type).map_err(|error| error.to_string())?;
    Ok(Deed::Value(at, value.encode(data_type)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script(text: &str) -> Result<Script, ScriptError> {
        Script::parse(text, &Catalogue::of_file("pressure.eds").expect("a data sheet"))
    }

    fn times(script: &mut Script, until: u64) -> Vec<(u64, Deed)> {
        let mut all = Vec::new();
        for now in (0..until).step_by(100_000) {
            while let Some(deed) = script.due(Instant(now), Instant(0)) {
                all.push((now, deed));
            }
        }
        all
    }

    #[test]
    fn lines_come_at_their_times_and_again() {
        let text = "# a step\n0.2 1017 = 7\n0 Producer heartbeat time = 5 # ms\n1 repeat\n";
        let value = |value: u16| Deed::Value(crate::object::at(0x1017, 0), value.to_le_bytes().to_vec());
        let expected = [(0, value(5)), (200_000, value(7)), (1_000_000, value(5)), (1_200_000, value(7))];
        assert_eq!(times(&mut script(text).unwrap(), 2_000_000), expected);
    }

    #[test]
    fn faults_are_the_classes_of_cia_301() {
        let deeds: Vec<Deed> = times(&mut script("0 emcy 4200\n1 emcy 0").unwrap(), 2_000_000)
            .into_iter()
            .map(|one| one.1)
            .collect();
        assert_eq!(deeds, [Deed::Fault(condition(0x4200).unwrap()), Deed::NoFault]);
    }

    #[test]
    fn a_wrong_line_is_named() {
        for (text, words) in [
            ("0 1017 = 5\nx 1017 = 5", "line 2: \"x\" is no time"),
            ("0 1017", "line 1: OBJECT = VALUE"),
            ("0 1017 = 70000", "line 1: \"70000\" is not a whole number"),
            ("0 2999 = 1", "line 1: 2999h:0 is not in the data sheet"),
            ("0 emcy 4242", "line 1: 4242h is none"),
            ("0 repeat", "line 1: 0 s is no period"),
            ("2 1017 = 5\n1 repeat", "line 2: a line is later"),
        ] {
            let error = script(text).unwrap_err().to_string();
            assert!(error.starts_with(words), "{text}: {error}");
        }
    }
}
