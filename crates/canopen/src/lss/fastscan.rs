//! Fastscan: the master finds the identity of an unconfigured slave bit by bit. All slaves answer with the same frame.

use super::{Identity, Part, Request};

/// State of a scan: the number of the part of the identity that is compared next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fastscan {
    part: u8,
}

/// Result of a step of the scan for the slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// No answer: the slave does not match, or the master compares another part.
    Silent,
    /// The compared bits match: the slave answers.
    Match,
    /// The whole identity has matched: the slave is selected.
    Found,
}

impl Fastscan {
    /// Takes a step. `bit` is the lowest bit that is compared.
    pub(super) fn step(&mut self, identity: &Identity, value: u32, bit: u8, part: u8, next: u8) -> Step {
        if bit == Request::CONFIRM {
            self.part = 0;
            return Step::Match;
        }
        let own = Part::numbered(part).filter(|_| part == self.part).map(|part| identity.part(part));
        let mask = u32::MAX.checked_shl(bit.into()).unwrap_or(0);
        if own.is_none_or(|own| (own ^ value) & mask != 0) {
            return Step::Silent;
        }
        self.part = next;
        // The master ends the scan by naming an earlier part as the next one.
        if bit == 0 && next < part { Step::Found } else { Step::Match }
    }
}
