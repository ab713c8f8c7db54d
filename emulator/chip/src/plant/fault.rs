//! Faults of the sensors and of the board, each with a span of virtual time.

use std::str::FromStr;

use canbus::Time;
use thiserror::Error;

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The wire of the pressure transducer's output is broken.
    OpenSensor,
    /// The transducer's output is shorted to its supply.
    RailHigh,
    /// The transducer's output is shorted to ground.
    RailLow,
    /// The wire of the thermistor is broken.
    OpenThermistor,
    /// The wires of the thermistor are shorted.
    ShortedThermistor,
    /// The incremental encoder gives no index pulse.
    MissingIndex,
    /// The data line of the absolute encoder is broken.
    OpenSsi,
    /// The absolute encoder sends a position that is half a revolution off.
    WrongCode,
    /// The absolute encoder sets its error bit.
    SsiError,
    /// The parity bit of the absolute encoder is wrong.
    SsiParity,
    /// The incremental encoder bounces between two steps.
    Bounce,
    /// No battery, or an empty one, at VBAT: a loss of the main supply is also a loss of the backup domain's supply.
    BatteryEmpty,
    /// No battery, and a main supply that returns soon: the backup SRAM has lost some of its bits.
    BatteryWeak,
    /// The clock on OSC_IN has stopped.
    NoCrystal,
}

const NAMES: [(&str, FaultKind); 14] = [
    ("open-sensor", FaultKind::OpenSensor),
    ("rail-high", FaultKind::RailHigh),
    ("rail-low", FaultKind::RailLow),
    ("open-thermistor", FaultKind::OpenThermistor),
    ("shorted-thermistor", FaultKind::ShortedThermistor),
    ("missing-index", FaultKind::MissingIndex),
    ("open-ssi", FaultKind::OpenSsi),
    ("wrong-code", FaultKind::WrongCode),
    ("ssi-error", FaultKind::SsiError),
    ("ssi-parity", FaultKind::SsiParity),
    ("bounce", FaultKind::Bounce),
    ("battery-empty", FaultKind::BatteryEmpty),
    ("battery-weak", FaultKind::BatteryWeak),
    ("no-crystal", FaultKind::NoCrystal),
];

impl FaultKind {
    /// All kinds of faults.
    pub fn all() -> impl Iterator<Item = FaultKind> {
        NAMES.into_iter().map(|(_, kind)| kind)
    }

    /// The name in the text form.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// A description of the fault.
    pub fn text(self) -> &'static str {
        match self {
            FaultKind::OpenSensor => "pressure transducer: broken wire",
            FaultKind::RailHigh => "pressure transducer: shorted to its supply",
            FaultKind::RailLow => "pressure transducer: shorted to ground",
            FaultKind::OpenThermistor => "thermistor: broken wire",
            FaultKind::ShortedThermistor => "thermistor: shorted",
            FaultKind::MissingIndex => "incremental encoder: no index pulse",
            FaultKind::OpenSsi => "absolute encoder: broken data line",
            FaultKind::WrongCode => "absolute encoder: half a revolution off",
            FaultKind::SsiError => "absolute encoder: error bit, in a format with one",
            FaultKind::SsiParity => "absolute encoder: wrong parity, in a format with parity",
            FaultKind::Bounce => "incremental encoder: bounces between two steps",
            FaultKind::BatteryEmpty => "battery: empty",
            FaultKind::BatteryWeak => "battery: too weak, the memory loses bits",
            FaultKind::NoCrystal => "crystal: stopped",
        }
    }

    fn named(name: &str) -> Result<FaultKind, FaultError> {
        let known = NAMES.iter().find(|known| known.0 == name);
        known.map(|known| known.1).ok_or_else(|| FaultError::Name(name.to_owned()))
    }
}

/// A fault that begins or ends now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultSwitch {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// `true` when the fault begins.
    pub is_on: bool,
}

impl FromStr for FaultSwitch {
    type Err = FaultError;

    /// `NAME:on` or `NAME:off`.
    fn from_str(spec: &str) -> Result<Self, FaultError> {
        let (name, is_on) = match spec.split_once(':') {
            Some((name, "on")) => (name, true),
            Some((name, "off")) => (name, false),
            _ => return Err(FaultError::Form(spec.to_owned())),
        };
        Ok(Self { kind: FaultKind::named(name)?, is_on })
    }
}

/// A fault and its span of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// The begin of the fault.
    pub from: Time,
    /// The end of the fault; [`Time::NEVER`] for a permanent fault.
    pub until: Time,
}

impl Fault {
    pub(super) fn is_active(&self, now: Time) -> bool {
        self.from <= now && now < self.until
    }

    /// The next begin or end of the fault; never when both are over.
    pub(super) fn next_edge(&self, now: Time) -> Time {
        [self.from, self.until].into_iter().find(|edge| now < *edge).unwrap_or(Time::NEVER)
    }
}

/// The reason why the text of a fault is invalid. Every message is one line.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum FaultError {
    /// The text is neither `NAME@SECONDS` nor `NAME:on`.
    #[error(
        "`{0}` is not of the form NAME@SECONDS or NAME@SECONDS..SECONDS, for example open-sensor@2.5; from now on: NAME:on, NAME:off"
    )]
    Form(String),
    /// No fault has this name.
    #[error("unknown fault `{0}`; known are {known}", known = NAMES.map(|known| known.0).join(", "))]
    Name(String),
    /// The time is not a number from 0 on.
    #[error("`{0}` is not a time in seconds")]
    Time(String),
    /// The fault ends before it begins.
    #[error("`{0}` ends before it starts")]
    Order(String),
}

impl FromStr for Fault {
    type Err = FaultError;

    /// `NAME@SECONDS` or `NAME@SECONDS..SECONDS`.
    fn from_str(spec: &str) -> Result<Self, FaultError> {
        let (name, times) = spec.split_once('@').ok_or_else(|| FaultError::Form(spec.to_owned()))?;
        let kind = FaultKind::named(name)?;
        let (from, until) = match times.split_once("..") {
            Some((from, until)) => (instant(from)?, instant(until)?),
            None => (instant(times)?, Time::NEVER),
        };
        if until <= from {
            return Err(FaultError::Order(spec.to_owned()));
        }
        Ok(Self { kind, from, until })
    }
}

fn instant(seconds: &str) -> Result<Time, FaultError> {
    let value: Option<f64> = seconds.trim().parse().ok();
    let value = value.filter(|value| value.is_finite() && *value >= 0.0);
    let value = value.ok_or_else(|| FaultError::Time(seconds.to_owned()))?;
    Ok(Time((value * Time::PER_SECOND as f64).round() as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_a_start_and_maybe_an_end() {
        let fault: Fault = "open-sensor@2.5".parse().unwrap();
        assert_eq!(fault.kind, FaultKind::OpenSensor);
        assert!(!fault.is_active(Time::from_millis(2499)) && fault.is_active(Time::from_millis(2500)));
        let fault: Fault = "missing-index@1..2".parse().unwrap();
        let active = [999, 1000, 1999, 2000].map(|t| fault.is_active(Time::from_millis(t)));
        assert_eq!(active, [false, true, true, false]);
    }

    #[test]
    fn a_switch_has_a_name_and_a_side() {
        assert_eq!("open-ssi:on".parse(), Ok(FaultSwitch { kind: FaultKind::OpenSsi, is_on: true }));
        assert_eq!("open-ssi:off".parse(), Ok(FaultSwitch { kind: FaultKind::OpenSsi, is_on: false }));
        for spec in ["open-ssi", "open-ssi:", "open-ssi:1", "broken:on"] {
            assert!(spec.parse::<FaultSwitch>().is_err(), "{spec}");
        }
        let mut names: Vec<&str> = FaultKind::all().map(FaultKind::name).collect();
        assert!(names.iter().all(|name| name.parse::<FaultSwitch>().is_err() && !name.is_empty()));
        names.dedup();
        assert_eq!(names.len(), NAMES.len());
    }

    #[test]
    fn mistakes_are_named_in_one_line() {
        let message = |spec: &str| spec.parse::<Fault>().unwrap_err().to_string();
        assert!(message("open-sensor").starts_with("`open-sensor` is not of the form NAME@SECONDS"));
        assert!(message("broken@1").starts_with("unknown fault `broken`; known are open-sensor"));
        assert_eq!(message("rail-low@-1"), "`-1` is not a time in seconds");
        assert_eq!(message("rail-low@2..1"), "`rail-low@2..1` ends before it starts");
    }
}
