//! The desk during one step, with the checks of this step.

use std::fmt::Display;

use anyhow::{Context, Result};
use canopen::{Duration, NodeId};
use nodectl::object::{Place, at};
use nodectl::sdo;

use crate::chip::Chip;
use crate::desk::{Action, Desk};
use crate::report::{Check, Result as Outcome};
use crate::values;

/// How long the steps measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Seconds of measurements over time.
    pub seconds: u64,
    /// Frames at each bit rate.
    pub frames: u32,
    /// Repetitions of whatever has to work each time.
    pub times: u32,
}

impl Effort {
    /// The bus of a real board.
    pub const FULL: Effort = Effort { seconds: 60, frames: 10_000, times: 20 };
    /// A first look.
    pub const SHORT: Effort = Effort { seconds: 5, frames: 60, times: 3 };
}

/// The object with the values of the board.
pub(crate) const SELF_TEST: u16 = 0x2005;

/// The desk, and what a step has checked.
pub struct Bench<'d> {
    /// The desk.
    pub desk: &'d mut dyn Desk,
    /// The node.
    pub node: NodeId,
    /// The chip that the board should have.
    pub chip: Chip,
    /// How long the step may measure.
    pub effort: Effort,
    /// The bit rate of the bus in kbit/s.
    pub kbit: u16,
    pub(crate) checks: Vec<Check>,
}

impl Bench<'_> {
    /// Notes a check.
    pub fn check(
        &mut self,
        what: &str,
        seen: impl Display,
        expected: impl Display,
        is_good: bool,
        remedy: &'static str,
    ) {
        let result = if is_good { Outcome::Green } else { Outcome::Red };
        self.note(what, seen, expected, result, remedy);
    }

    /// Notes something that the user should know and that is no failure.
    pub fn remark(&mut self, what: &str, seen: impl Display, expected: impl Display, remedy: &'static str) {
        self.note(what, seen, expected, Outcome::Skipped, remedy);
    }

    fn note(
        &mut self,
        what: &str,
        seen: impl Display,
        expected: impl Display,
        result: Outcome,
        remedy: &'static str,
    ) {
        self.checks.push(Check {
            what: what.to_owned(),
            seen: seen.to_string(),
            expected: expected.to_string(),
            result,
            remedy: remedy.to_owned(),
        });
    }

    /// Checks that a number is in a range.
    pub fn check_range(
        &mut self,
        what: &str,
        seen: f64,
        (least, most): (f64, f64),
        unit: &str,
        remedy: &'static str,
    ) {
        let is_good = (least..=most).contains(&seen);
        self.check(what, format!("{seen:.2} {unit}"), format!("{least} to {most} {unit}"), is_good, remedy);
    }

    /// Has the user do something; notes it when it was skipped.
    ///
    /// # Errors
    /// No operator is there.
    pub fn by_hand(&mut self, action: Action) -> Result<bool> {
        let is_done = self.desk.by_hand(action)?;
        if !is_done {
            self.remark(&action.to_string(), "skipped", "done", "repeat the step with --step");
        }
        Ok(is_done)
    }

    /// A word through the debug probe.
    ///
    /// # Errors
    /// The probe does not read it.
    pub fn word(&mut self, address: u32) -> Result<u32> {
        let words = self.desk.words(address, 1)?;
        words.first().copied().with_context(|| format!("the probe reads nothing at {address:#010x}"))
    }

    /// The value of an object, as a number.
    ///
    /// # Errors
    /// The node does not answer.
    pub fn object(&mut self, index: u16, sub: u8) -> Result<u32> {
        let place = at(index, sub);
        let bytes = self.client().upload(place).with_context(|| Place(place).to_string())?;
        Ok(bytes
            .iter()
            .rev()
            .skip(bytes.len().saturating_sub(4))
            .fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }

    /// Waits for an answer of the node.
    ///
    /// # Errors
    /// None has come in this time.
    pub fn answers_within(&mut self, time: Duration) -> Result<()> {
        let end = self.desk.network().now() + time;
        loop {
            let answer = self.object(0x1000, 0).map(drop);
            if answer.is_ok() || self.desk.network().now() >= end {
                return answer;
            }
        }
    }

    /// The value of an object of type REAL32.
    ///
    /// # Errors
    /// The node does not answer.
    pub fn real(&mut self, index: u16, sub: u8) -> Result<f64> {
        Ok(f32::from_bits(self.object(index, sub)?).into())
    }

    /// Writes an object.
    ///
    /// # Errors
    /// The node refuses it, or does not answer.
    pub fn set(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<()> {
        self.client().download(at(index, sub), value, |_| ()).map_err(Into::into)
    }

    /// A value of the board in 2005h, through the bus.
    ///
    /// # Errors
    /// The node does not answer.
    pub fn self_test(&mut self, number: u8) -> Result<u32> {
        self.set(SELF_TEST, 0, &values::selection(number))?;
        self.object(SELF_TEST, 0)
    }

    /// A value of the board in 2005h that only development images have; otherwise `None`, with a remark.
    ///
    /// # Errors
    /// The node does not answer.
    pub fn start_test(&mut self, what: &str, number: u8) -> Result<Option<u32>> {
        let value = self.self_test(number)?;
        // The clock of a development image takes some time to start.
        let is_tested = self.self_test(values::CLOCK_WAIT)? != 0;
        if !is_tested {
            self.remark(what, "not tested", "a value", "Flash development images for this check");
        }
        Ok(is_tested.then_some(value))
    }

    fn client(&mut self) -> sdo::Client<'_> {
        let node = self.node;
        sdo::Client::new(self.desk.network(), node, sdo::Options::default())
    }

    /// Lets time pass.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn wait(&mut self, time: Duration) -> Result<()> {
        Ok(self.desk.network().pause(time)?)
    }
}
