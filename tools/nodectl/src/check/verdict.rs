//! What comes of a check.

use crate::bus::BusError;

/// What a check found against its rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deviation {
    /// What the rule expects.
    pub expected: String,
    /// What the device did.
    pub seen: String,
}

/// Why a check ends before its end.
#[derive(Debug)]
pub enum Stop {
    /// The device breaks the rule.
    Failed(Deviation),
    /// The rule cannot be tried on this device: the reason.
    Skipped(String),
    /// The bus is lost.
    Bus(BusError),
}

/// `Ok` where the device follows the rule.
pub type Outcome<T = ()> = std::result::Result<T, Stop>;

/// The verdict on one rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The device follows the rule.
    Passed,
    /// The device breaks a rule that is demanded.
    Failed(Deviation),
    /// The device does otherwise than a clause recommends.
    Recommended(Deviation),
    /// The rule was not tried: the reason. It is no pass.
    Skipped(String),
}

impl Verdict {
    /// In one word.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed(_) => "failed",
            Verdict::Recommended(_) => "recommended",
            Verdict::Skipped(_) => "skipped",
        }
    }

    /// What was expected and seen instead.
    #[must_use]
    pub const fn deviation(&self) -> Option<&Deviation> {
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

/// The device breaks the rule.
pub(super) fn fail(expected: impl ToString, seen: impl ToString) -> Stop {
    Stop::Failed(Deviation { expected: expected.to_string(), seen: seen.to_string() })
}

/// The rule cannot be tried.
pub(super) fn skip(reason: impl ToString) -> Stop {
    Stop::Skipped(reason.to_string())
}

/// Fails unless it holds.
pub(super) fn ensure(holds: bool, expected: impl ToString, seen: impl ToString) -> Outcome {
    if holds { Ok(()) } else { Err(fail(expected, seen)) }
}
