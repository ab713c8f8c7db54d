//! What the sensors see, and which boards a specification is meant for.

use std::fmt;
use std::str::FromStr;

use canbus::Time;
use chip::plant::{BUTTONS, Fault, FaultSwitch, Motion, Plant, Push, Signal};
use serde::Serialize;

use crate::cli::{BOARD_NUMBERS, board_number};
use crate::personality::Personality;

/// A change of what a board's sensors see.
#[derive(Clone, Debug, PartialEq)]
pub enum Stimulus {
    /// In Pa.
    Pressure(Signal),
    /// Of the chip, in K.
    Temperature(Signal),
    /// Of the thermistor, in K.
    Thermistor(Signal),
    /// In revolutions, or a speed.
    Shaft(Motion),
    /// A button is pressed or released.
    Button(Push),
    /// A defect of the wiring or of a sensor.
    Fault(Fault),
    /// One that comes now, or goes.
    Switch(FaultSwitch),
}

impl Stimulus {
    /// Reads `[ID=]SPEC` of a kind: pressure, temperature, thermistor, shaft, button or fault.
    ///
    /// # Errors
    /// One line that says what is wrong.
    pub fn parse(kind: &str, text: &str) -> Result<Targeted<Stimulus>, String> {
        match kind {
            "pressure" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Pressure)),
            "temperature" => in_kelvin(text).map(|spec| spec.map(Stimulus::Temperature)),
            "thermistor" => in_kelvin(text).map(|spec| spec.map(Stimulus::Thermistor)),
            "shaft" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Shaft)),
            "button" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Button)),
            "fault" if text.ends_with(":on") || text.ends_with(":off") => {
                text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Switch))
            }
            "fault" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Fault)),
            _ => Err(format!(
                "{kind:?} is no stimulus; there are pressure, temperature, thermistor, shaft, button and fault"
            )),
        }
    }

    /// Lets it act from `now` on.
    pub(crate) fn act_on(&self, plant: &mut Plant, now: Time) {
        match self.clone() {
            Stimulus::Pressure(signal) => plant.set_pressure(signal, now),
            Stimulus::Temperature(signal) => plant.set_temperature(signal, now),
            Stimulus::Thermistor(signal) => plant.set_thermistor(signal, now),
            Stimulus::Shaft(motion) => plant.set_shaft(motion, now),
            Stimulus::Button(push) => plant.push(push, now),
            Stimulus::Fault(fault) => plant.add_fault(fault),
            Stimulus::Switch(switch) => plant.switch_fault(switch, now),
        }
    }
}

/// What the sensors of one board see at a moment.
#[derive(Clone, Debug, Serialize)]
pub struct BoardStimuli {
    /// Its number on the command line.
    pub board: u8,
    /// The node-ID with which it has booted.
    pub node: u8,
    /// What it is.
    pub personality: Personality,
    /// In Pa.
    pub pressure: Knob,
    /// Of the chip, in K.
    pub temperature: Knob,
    /// Of the thermistor, in K.
    pub thermistor: Knob,
    /// In revolutions.
    pub shaft: Knob,
    /// Which of its buttons are held down.
    pub buttons: [bool; BUTTONS],
    /// The faults that are there.
    pub faults: Vec<&'static str>,
}

/// A quantity.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    /// What it is set to, as on the command line.
    pub spec: String,
    /// Its value now.
    pub value: f64,
}

/// What is colder than -100 degC was meant in degC.
const COLDEST: f64 = 173.15;

fn in_kelvin(text: &str) -> Result<Targeted<Signal>, String> {
    let spec: Targeted<Signal> = text.parse()?;
    let lowest = spec.what.lowest();
    if lowest < COLDEST {
        return Err(format!(
            "{lowest} K is {:.2} degC; temperatures are in K, e.g. const:298.15",
            lowest - 273.15
        ));
    }
    Ok(spec)
}

/// Something for one node, written `ID=SPEC`, or for all of them, written `SPEC`.
#[derive(Clone, Debug, PartialEq)]
pub struct Targeted<T> {
    /// The node; `None` for all.
    pub node: Option<u8>,
    /// What it is to get.
    pub what: T,
}

impl<T> Targeted<T> {
    /// Whether the node of this ID is meant.
    pub fn is_for(&self, node: u8) -> bool {
        self.node.is_none_or(|target| target == node)
    }

    /// The same nodes, another thing.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Targeted<U> {
        Targeted { node: self.node, what: change(self.what) }
    }
}

impl<T: FromStr> FromStr for Targeted<T>
where
    T::Err: fmt::Display,
{
    type Err = String;

    /// An equals sign inside a SPEC, as in a file name, is no target: a target is a number.
    fn from_str(text: &str) -> Result<Targeted<T>, String> {
        let target = text.split_once('=').filter(|(id, _)| id.bytes().all(|byte| byte.is_ascii_digit()));
        let (node, spec) = match target {
            Some((id, spec)) => {
                let id = board_number(id).ok_or_else(|| format!("{id:?} is no board: {BOARD_NUMBERS}"));
                (Some(id?), spec)
            }
            None => (None, text),
        };
        spec.parse().map(|what| Targeted { node, what }).map_err(|error: T::Err| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_celsius_are_noticed() {
        for kind in ["temperature", "thermistor"] {
            let refused = Stimulus::parse(kind, "1=const:25").unwrap_err();
            assert_eq!(refused, "25 K is -248.15 degC; temperatures are in K, e.g. const:298.15");
            assert!(Stimulus::parse(kind, "const:298.15").is_ok());
        }
        assert!(Stimulus::parse("pressure", "const:25").is_ok());
    }

    #[test]
    fn a_target_is_a_node_id_before_an_equals_sign() {
        let read = |text: &str| text.parse::<Targeted<String>>();
        assert_eq!(read("const:1"), Ok(Targeted { node: None, what: "const:1".into() }));
        assert_eq!(read("12=const:1"), Ok(Targeted { node: Some(12), what: "const:1".into() }));
        assert_eq!(read("csv:a=b.csv"), Ok(Targeted { node: None, what: "csv:a=b.csv".into() }));
        assert!(read("128=const:1").is_err());
        assert!(read("=const:1").is_err());
        assert!("1=x".parse::<Targeted<f64>>().is_err());
        assert!(read("3=x").unwrap().is_for(3) && !read("3=x").unwrap().is_for(4));
        assert!(read("x").unwrap().is_for(4));
    }
}
