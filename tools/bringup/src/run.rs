//! Runs the steps in their order.

use canopen::NodeId;

use crate::bench::Bench;
use crate::chip::Chip;
use crate::desk::Desk;
use crate::report::{Check, Report, Result, StepReport};
use crate::steps::Step;

pub use crate::bench::Effort;

/// The board of a run.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    /// The node-ID.
    pub node: NodeId,
    /// The chip.
    pub chip: Chip,
    /// The bit rate of the bus in kbit/s.
    pub kbit: u16,
}

/// Runs one step. A step that cannot go on has failed.
pub fn step(step: &Step, desk: &mut dyn Desk, subject: Subject, effort: Effort) -> StepReport {
    let Subject { node, chip, kbit } = subject;
    let mut bench = Bench { desk, node, chip, effort, kbit, checks: Vec::new() };
    if let Err(error) = (step.run)(&mut bench) {
        bench.check("the step", format!("{error:#}"), "no error", false, step.remedy);
    }
    let checks = bench.checks;
    StepReport {
        number: step.number,
        name: step.name.to_owned(),
        about: step.about.to_owned(),
        result: of_all(&checks),
        checks,
    }
}

/// Red if a check is; skipped if nothing was checked.
fn of_all(checks: &[Check]) -> Result {
    if checks.iter().any(|check| check.result == Result::Red) {
        Result::Red
    } else if checks.iter().any(|check| check.result == Result::Green) {
        Result::Green
    } else {
        Result::Skipped
    }
}

/// Runs the steps that are not green yet, up to the first that is red. `tell` is called after each one.
pub fn all(
    steps: &[&Step],
    desk: &mut dyn Desk,
    subject: Subject,
    effort: Effort,
    report: &mut Report,
    mut tell: impl FnMut(&StepReport, &Report),
) -> Result {
    for next in steps {
        if report.is_green(next.number) {
            continue;
        }
        let done = step(next, desk, subject, effort);
        report.set(done.clone());
        tell(&done, report);
        if done.result == Result::Red {
            return Result::Red;
        }
    }
    Result::Green
}
