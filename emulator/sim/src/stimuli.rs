//! The stimuli of the sensors, and the boards that a specification applies to.

use std::fmt;
use std::str::FromStr;

use canbus::Time;
use chip::plant::{Fault, FaultKind, FaultSwitch, Motion, Push, Signal};
use chip::{BUTTONS, SsiFormat, Stm32f4};
use clap::Args;
use serde::Serialize;

use crate::cli::{BOARD_NUMBERS, board_number};
use crate::personality::Personality;

/// A change of a board's stimuli.
#[derive(Clone, Debug, PartialEq)]
pub enum Stimulus {
    /// The pressure, in Pa.
    Pressure(Signal),
    /// The temperature of the chip, in K.
    Temperature(Signal),
    /// The temperature of the thermistor, in K.
    Thermistor(Signal),
    /// The supply of the chip, in V.
    Supply(Signal),
    /// The position of the shaft in revolutions, or its speed.
    Shaft(Motion),
    /// The format of the absolute encoder.
    Ssi(SsiFormat),
    /// A button is pressed or released.
    Button(Push),
    /// A fault of the wiring or of a sensor, with its span of time.
    Fault(Fault),
    /// A fault that begins or ends now.
    Switch(FaultSwitch),
}

impl Stimulus {
    /// Parses `[ID=]SPEC` of one of the [`KINDS`].
    ///
    /// # Errors
    /// One line that describes the error.
    pub fn parse(kind: &str, text: &str) -> Result<Targeted<Stimulus>, String> {
        match kind {
            "pressure" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Pressure)),
            "temperature" => in_kelvin(text).map(|spec| spec.map(Stimulus::Temperature)),
            "thermistor" => in_kelvin(text).map(|spec| spec.map(Stimulus::Thermistor)),
            "supply" => in_volts(text).map(|spec| spec.map(Stimulus::Supply)),
            "power" => {
                text.parse().map(|spec: Targeted<Power>| spec.map(|Power(signal)| Stimulus::Supply(signal)))
            }
            "ssi" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Ssi)),
            "shaft" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Shaft)),
            "button" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Button)),
            "fault" if text.ends_with(":on") || text.ends_with(":off") => {
                text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Switch))
            }
            "fault" => text.parse().map(|spec: Targeted<_>| spec.map(Stimulus::Fault)),
            _ => Err(format!("{kind:?} is no stimulus; there are {}", KINDS.join(", "))),
        }
    }

    /// Applies the stimulus from `now` on.
    pub(crate) fn act_on(&self, chip: &mut Stm32f4, now: Time) {
        let plant = chip.plant_mut(now);
        match self.clone() {
            Stimulus::Ssi(format) => chip.set_ssi(format, now),
            Stimulus::Pressure(signal) => plant.set_pressure(signal, now),
            Stimulus::Temperature(signal) => plant.set_temperature(signal, now),
            Stimulus::Thermistor(signal) => plant.set_thermistor(signal, now),
            Stimulus::Supply(signal) => plant.set_supply(signal, now),
            Stimulus::Shaft(motion) => plant.set_shaft(motion, now),
            Stimulus::Button(push) => plant.push(push, now),
            Stimulus::Fault(fault) => plant.add_fault(fault),
            Stimulus::Switch(switch) => plant.switch_fault(switch, now),
        }
    }
}

/// The flags of the command line that set stimuli from the start on.
#[derive(Debug, Args)]
pub struct Flags {
    /// Pressure at the sensor in Pa, e.g. const:250000 or sine:250000,100000,2.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("pressure", text))]
    pub pressure: Vec<Targeted<Stimulus>>,

    /// Temperature of the chip in K, e.g. const:298.15.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("temperature", text))]
    pub temperature: Vec<Targeted<Stimulus>>,

    /// Temperature of the thermistor in K, e.g. const:298.15.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("thermistor", text))]
    pub thermistor: Vec<Targeted<Stimulus>>,

    /// Supply of the chip in V, e.g. ramp:3.3,1.7,2.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("supply", text))]
    pub supply: Vec<Targeted<Stimulus>>,

    /// The encoder's shaft in revolutions, or its speed, e.g. const:0.25 or rpm:6000.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("shaft", text))]
    pub shaft: Vec<Targeted<Stimulus>>,

    /// Format of the absolute encoder, e.g. 12+13,gray,error,even: bits of the turns and the steps, coding, error bit,
    /// parity.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("ssi", text))]
    pub ssi: Vec<Targeted<Stimulus>>,

    /// Press or release a button, e.g. 1:down.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("button", text))]
    pub button: Vec<Targeted<Stimulus>>,

    /// A fault from a time on, e.g. open-sensor@2.5.
    #[arg(long, value_name = "[ID=]SPEC", value_parser = |text: &str| Stimulus::parse("fault", text))]
    pub fault: Vec<Targeted<Stimulus>>,
}

impl Flags {
    /// The stimuli in the order of the flags.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Targeted<Stimulus>> {
        let Flags { pressure, temperature, thermistor, supply, shaft, ssi, button, fault } = self;
        [pressure, temperature, thermistor, supply, shaft, ssi, button, fault].into_iter().flatten()
    }
}

/// The stimuli of one board at an instant.
#[derive(Clone, Debug, Serialize)]
pub struct BoardStimuli {
    /// The board's number on the command line.
    pub board: u8,
    /// The node-ID that the node has booted with.
    pub node: u8,
    /// The personality.
    pub personality: Personality,
    /// The inputs of the board.
    #[serde(flatten)]
    pub inputs: Inputs,
}

/// The inputs of a board: the setting and the present value of each.
#[derive(Clone, Debug, Serialize)]
pub struct Inputs {
    /// The pressure, in Pa.
    pub pressure: Knob,
    /// The temperature of the chip, in K.
    pub temperature: Knob,
    /// The temperature of the thermistor, in K.
    pub thermistor: Knob,
    /// The supply of the chip, in V.
    pub supply: Knob,
    /// The position of the shaft, in revolutions.
    pub shaft: Knob,
    /// The format of the absolute encoder.
    pub ssi: String,
    /// The buttons that are held down.
    pub buttons: [bool; BUTTONS],
    /// The names of the active faults.
    pub faults: Vec<&'static str>,
}

impl Inputs {
    /// The present inputs of a chip.
    pub(crate) fn of(chip: &Stm32f4, now: Time) -> Inputs {
        let plant = chip.plant();
        let knob = |spec: &dyn ToString, value| Knob { spec: spec.to_string(), value };
        Inputs {
            pressure: knob(plant.pressure_signal(), plant.pressure(now)),
            temperature: knob(plant.temperature_signal(), plant.temperature(now)),
            thermistor: knob(plant.thermistor_signal(), plant.thermistor(now)),
            supply: knob(plant.supply_signal(), plant.supply(now)),
            shaft: knob(plant.motion(), plant.revolutions(now)),
            ssi: chip.ssi().to_string(),
            buttons: plant.held(),
            faults: plant.faults(now).map(FaultKind::name).collect(),
        }
    }
}

/// The kinds of stimuli.
pub const KINDS: [&str; 9] =
    ["pressure", "temperature", "thermistor", "supply", "power", "shaft", "ssi", "button", "fault"];

/// The supply of the board is switched.
struct Power(Signal);

/// The supply that is on, in V.
const ON: f64 = 3.3;

impl FromStr for Power {
    type Err = String;

    /// `off`, `on`, or `off:SECONDS` for a cut of the supply.
    fn from_str(text: &str) -> Result<Power, String> {
        let seconds = |text: &str| text.parse().ok().filter(|at: &f64| at.is_finite() && *at > 0.0);
        let signal = match text.split_once(':') {
            None if text == "off" => Some(Signal::Constant(0.0)),
            None if text == "on" => Some(Signal::Constant(ON)),
            Some(("off", time)) => seconds(time).map(|at| Signal::Step { from: 0.0, to: ON, at }),
            _ => None,
        };
        signal.map(Power).ok_or_else(|| format!("`{text}` is not off, on or off:SECONDS"))
    }
}

/// A quantity with its setting.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    /// The setting, as written on the command line.
    pub spec: String,
    /// The current value.
    pub value: f64,
}

/// A temperature below -100 degC is refused: the user probably meant degC instead of K.
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

/// The highest supply that the chip survives (data sheet, absolute maximum ratings), in V.
const HIGHEST_SUPPLY: f64 = 4.0;

fn in_volts(text: &str) -> Result<Targeted<Signal>, String> {
    let spec: Targeted<Signal> = text.parse()?;
    let is_possible = spec.what.lowest() >= 0.0 && spec.what.highest() <= HIGHEST_SUPPLY;
    if is_possible { Ok(spec) } else { Err(format!("`{text}` is no supply of 0 to {HIGHEST_SUPPLY} V")) }
}

/// A value for one node, written `ID=SPEC`, or for all nodes, written `SPEC`.
#[derive(Clone, Debug, PartialEq)]
pub struct Targeted<T> {
    /// The node; `None` for all.
    pub node: Option<u8>,
    /// The value.
    pub what: T,
}

impl<T> Targeted<T> {
    /// Whether the value applies to the node with this ID.
    pub fn is_for(&self, node: u8) -> bool {
        self.node.is_none_or(|target| target == node)
    }

    /// Another value for the same nodes.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Targeted<U> {
        Targeted { node: self.node, what: change(self.what) }
    }
}

impl<T: FromStr> FromStr for Targeted<T>
where
    T::Err: fmt::Display,
{
    type Err = String;

    /// Only a number before an equals sign is a target: the SPEC itself may contain an equals sign, as in a file name.
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
    fn a_supply_that_no_chip_survives_is_refused() {
        for text in ["const:-1", "const:100", "ramp:3.3,4.5,1", "sine:3,2,1", "step:5,3,1", "noise:4.1,0.1"] {
            let refused = Stimulus::parse("supply", text).unwrap_err();
            assert!(refused.contains("0 to 4 V"), "{text}: {refused}");
        }
        for text in ["const:0", "const:4", "ramp:3.3,1.5,0.7", "noise:3.3,0.1"] {
            assert!(Stimulus::parse("supply", text).is_ok(), "{text}");
        }
    }

    #[test]
    fn the_power_is_a_supply_without_a_ramp() {
        let cut = Signal::Step { from: 0.0, to: 3.3, at: 0.5 };
        for (text, signal) in
            [("off", Signal::Constant(0.0)), ("on", Signal::Constant(3.3)), ("off:0.5", cut)]
        {
            let read = Stimulus::parse("power", text).unwrap();
            assert_eq!(read.what, Stimulus::Supply(signal), "{text}");
        }
        for text in ["", "1", "off:", "off:0", "off:x", "on:1"] {
            assert!(Stimulus::parse("power", text).is_err(), "{text}");
        }
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
