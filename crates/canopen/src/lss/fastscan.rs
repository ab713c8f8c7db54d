//! Fastscan: the master finds the identity of an unconfigured slave bit by bit. All slaves answer with the same frame.

use super::{Request, word};

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
    /// Takes the frame of a step.
    pub(super) fn step(&mut self, frame: [u8; 8], identity: impl Fn(u8) -> u32) -> Step {
        // The lowest bit that is compared, its part, and the part to compare next.
        let [.., bit, part, next] = frame;
        if part > 3 || next > 3 || bit > 31 && bit != Request::CONFIRM {
            return Step::Silent;
        }
        if bit == Request::CONFIRM {
            self.part = 0;
            return Step::Match;
        }
        let mask = u32::MAX << (bit & 31);
        if part != self.part || (identity(part) ^ word(frame)) & mask != 0 {
            return Step::Silent;
        }
        self.part = next;
        // The master ends the scan by naming an earlier part as the next one.
        if bit == 0 && next < part { Step::Found } else { Step::Match }
    }
}
