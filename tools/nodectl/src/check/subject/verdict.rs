//! Outcomes and verdicts of checks.

use crate::bus::BusError;

/// A deviation of the device from a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deviation {
    /// The behaviour that the rule expects.
    pub expected: String,
    /// The behaviour of the device.
    pub seen: String,
}

/// Why a check ends early.
#[derive(Debug)]
pub enum Stop {
    /// The device breaks the rule.
    Failed(Deviation),
    /// The rule cannot be tried on this device, with the reason.
    Skipped(String),
    /// The bus is lost.
    Bus(BusError),
    /// The user has interrupted the run.
    Interrupted,
}

/// The outcome of a check: `Ok` where the device follows the rule.
pub type Outcome<T = ()> = std::result::Result<T, Stop>;

/// The verdict on one rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The device follows the rule.
    Passed,
    /// The device breaks a demanded rule.
    Failed(Deviation),
    /// The device breaks a recommended rule.
    Recommended(Deviation),
    /// The rule was not tried, with the reason. This is not a pass.
    Skipped(String),
}

impl Verdict {
    /// The verdict as one word.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed(_) => "failed",
            Verdict::Recommended(_) => "recommended",
            Verdict::Skipped(_) => "skipped",
        }
    }

    /// The expected and the seen behaviour, where the verdict has them.
    #[must_use]
    pub const fn deviation(&self) -> Option<&Deviation> {
        match self {
            Verdict::Failed(deviation) | Verdict::Recommended(deviation) => Some(deviation),
            _ => None,
        }
    }

    pub(in crate::check) const fn deviation_mut(&mut self) -> Option<&mut Deviation> {
        match self {
            Verdict::Failed(deviation) | Verdict::Recommended(deviation) => Some(deviation),
            _ => None,
        }
    }
}

impl From<BusError> for Stop {
    fn from(error: BusError) -> Stop {
        Stop::Bus(error)
    }
}

/// The outcome of a device that breaks the rule.
pub(in crate::check) fn fail(expected: impl ToString, seen: impl ToString) -> Stop {
    Stop::Failed(Deviation { expected: expected.to_string(), seen: seen.to_string() })
}

/// The outcome of a rule that cannot be tried.
pub(in crate::check) fn skip(reason: impl ToString) -> Stop {
    Stop::Skipped(reason.to_string())
}

/// Fails unless a condition holds.
pub(in crate::check) fn ensure(holds: bool, expected: impl ToString, seen: impl ToString) -> Outcome {
    if holds { Ok(()) } else { Err(fail(expected, seen)) }
}
