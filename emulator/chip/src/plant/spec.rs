//! The text form of stimuli, `NAME:ARGUMENTS`, as used on the command line.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use thiserror::Error;

use super::shaft::Motion;
use super::signal::Signal;
use super::table::{Table, TableError};

/// The reason why the text of a stimulus is invalid. Every message is one line.
#[derive(Debug, Error, PartialEq)]
pub enum SpecError {
    /// No `:` between name and arguments.
    #[error("`{0}` is not of the form NAME:ARGUMENTS, for example const:250000")]
    Form(String),
    /// No signal has this name.
    #[error("unknown signal `{0}`; known are const, sine, ramp, step, noise and csv, and rpm for the shaft")]
    Name(String),
    /// The number of arguments does not fit the signal.
    #[error("{name} takes {expected}, not `{given}`")]
    Arguments {
        /// Name of the signal.
        name: &'static str,
        /// The arguments of the signal.
        expected: &'static str,
        /// The given text.
        given: String,
    },
    /// An argument that is not a finite number.
    #[error("`{0}` is not a number")]
    Number(String),
    /// An argument outside of its range.
    #[error("{0}")]
    Range(&'static str),
    /// A CSV file that cannot be used.
    #[error(transparent)]
    Table(#[from] TableError),
}

impl FromStr for Signal {
    type Err = SpecError;

    /// `const:V`, `sine:OFFSET,AMPLITUDE,HERTZ`, `ramp:FROM,TO,SECONDS`, `step:FROM,TO,AT`,
    /// `noise:MEAN,SIGMA[,SEED]` or `csv:PATH`.
    fn from_str(spec: &str) -> Result<Self, SpecError> {
        let (name, arguments) = split(spec)?;
        match name {
            "const" => constant(arguments),
            "sine" => sine(arguments),
            "ramp" => ramp(arguments),
            "step" => step(arguments),
            "noise" => noise(arguments),
            "csv" => Ok(Signal::Table(Table::open(Path::new(arguments))?)),
            _ => Err(SpecError::Name(name.to_owned())),
        }
    }
}

/// The text form that `from_str` reads; a table is shown without its file name.
impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Signal::Constant(value) => write!(f, "const:{value}"),
            Signal::Sine { offset, amplitude, hertz } => write!(f, "sine:{offset},{amplitude},{hertz}"),
            Signal::Ramp { from, to, seconds } => write!(f, "ramp:{from},{to},{seconds}"),
            Signal::Step { from, to, at } => write!(f, "step:{from},{to},{at}"),
            Signal::Noise { mean, sigma, seed } => write!(f, "noise:{mean},{sigma},{seed}"),
            Signal::Table(_) => f.write_str("csv"),
        }
    }
}

/// The text form that `from_str` reads.
impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Motion::Rpm(rpm) => write!(f, "rpm:{rpm}"),
            Motion::Angle(signal) => signal.fmt(f),
        }
    }
}

impl FromStr for Motion {
    type Err = SpecError;

    /// `rpm:N`, or a signal in revolutions.
    fn from_str(spec: &str) -> Result<Self, SpecError> {
        match split(spec)? {
            ("rpm", arguments) => {
                let [rpm] = numbers("rpm", "one number", arguments)?;
                Ok(Motion::Rpm(rpm))
            }
            _ => spec.parse().map(Motion::Angle),
        }
    }
}

fn split(spec: &str) -> Result<(&str, &str), SpecError> {
    spec.split_once(':').ok_or_else(|| SpecError::Form(spec.to_owned()))
}

fn constant(arguments: &str) -> Result<Signal, SpecError> {
    let [value] = numbers("const", "one number", arguments)?;
    Ok(Signal::Constant(value))
}

fn sine(arguments: &str) -> Result<Signal, SpecError> {
    let [offset, amplitude, hertz] = numbers("sine", "OFFSET,AMPLITUDE,HERTZ", arguments)?;
    within(hertz >= 0.0, "the frequency of a sine cannot be negative")?;
    Ok(Signal::Sine { offset, amplitude, hertz })
}

fn ramp(arguments: &str) -> Result<Signal, SpecError> {
    let [from, to, seconds] = numbers("ramp", "FROM,TO,SECONDS", arguments)?;
    within(seconds > 0.0, "a ramp takes more than 0 seconds")?;
    Ok(Signal::Ramp { from, to, seconds })
}

fn step(arguments: &str) -> Result<Signal, SpecError> {
    let [from, to, at] = numbers("step", "FROM,TO,AT", arguments)?;
    Ok(Signal::Step { from, to, at })
}

fn noise(arguments: &str) -> Result<Signal, SpecError> {
    let (arguments, seed) = match arguments.split(',').count() {
        3 => arguments.rsplit_once(',').map_or((arguments, "0"), |parts| parts),
        _ => (arguments, "0"),
    };
    let [mean, sigma] = numbers("noise", "MEAN,SIGMA[,SEED]", arguments)?;
    within(sigma >= 0.0, "the deviation of noise cannot be negative")?;
    let seed = seed.trim().parse().map_err(|_| SpecError::Number(seed.to_owned()))?;
    Ok(Signal::Noise { mean, sigma, seed })
}

fn within(holds: bool, message: &'static str) -> Result<(), SpecError> {
    if holds { Ok(()) } else { Err(SpecError::Range(message)) }
}

fn numbers<const N: usize>(
    name: &'static str,
    expected: &'static str,
    given: &str,
) -> Result<[f64; N], SpecError> {
    let values = given.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    values.try_into().map_err(|_| SpecError::Arguments { name, expected, given: given.to_owned() })
}

/// A finite number.
pub(super) fn number(text: &str) -> Result<f64, SpecError> {
    let value = text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| SpecError::Number(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(spec: &str) -> String {
        spec.parse::<Signal>().expect_err("a bad spec").to_string()
    }

    #[test]
    fn every_signal_is_understood() {
        let cases = [
            ("const:250000", Signal::Constant(250_000.0)),
            ("sine:2.5e5,100000,2", Signal::Sine { offset: 250_000.0, amplitude: 100_000.0, hertz: 2.0 }),
            ("ramp:0, 10, 2", Signal::Ramp { from: 0.0, to: 10.0, seconds: 2.0 }),
            ("step:1,2,0.5", Signal::Step { from: 1.0, to: 2.0, at: 0.5 }),
            ("noise:5,0.1", Signal::Noise { mean: 5.0, sigma: 0.1, seed: 0 }),
            ("noise:5,0.1,7", Signal::Noise { mean: 5.0, sigma: 0.1, seed: 7 }),
        ];
        for (spec, signal) in cases {
            assert_eq!(spec.parse(), Ok(signal.clone()), "{spec}");
            assert_eq!(signal.to_string().parse(), Ok(signal), "{spec}");
        }
    }

    #[test]
    fn a_shaft_turns_or_stands() {
        assert_eq!("rpm:-6000".parse(), Ok(Motion::Rpm(-6000.0)));
        assert_eq!(Motion::Rpm(-6000.0).to_string(), "rpm:-6000");
        assert_eq!("const:0.25".parse(), Ok(Motion::Angle(Signal::Constant(0.25))));
        assert_eq!("rpm:1,2".parse::<Motion>().unwrap_err().to_string(), "rpm takes one number, not `1,2`");
    }

    #[test]
    fn mistakes_are_named_in_one_line() {
        assert_eq!(message("250000"), "`250000` is not of the form NAME:ARGUMENTS, for example const:250000");
        assert!(message("saw:1").starts_with("unknown signal `saw`; known are const"));
        assert_eq!(message("sine:1,2"), "sine takes OFFSET,AMPLITUDE,HERTZ, not `1,2`");
        assert_eq!(message("const:high"), "`high` is not a number");
        assert_eq!(message("const:inf"), "`inf` is not a number");
        assert_eq!(message("noise:1,2,-3"), "`-3` is not a number");
        assert_eq!(message("ramp:0,1,0"), "a ramp takes more than 0 seconds");
        assert_eq!(message("noise:0,-1"), "the deviation of noise cannot be negative");
        assert!(message("csv:/nonexistent").starts_with("cannot read /nonexistent: "));
    }
}
