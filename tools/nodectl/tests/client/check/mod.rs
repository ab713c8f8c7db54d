//! Tests of `nodectl check` with nodes in this process: our own node, and a device to which many faults can be added.

mod command;
mod device;
mod faulty;
mod interruption;
mod layers;
mod own;
mod reference;
mod stalls;
mod switches;

use nodectl::Network;
use nodectl::bus::Station;
use nodectl::check::{self, Effect, Profile, Run, Setup, Subject, Verdict};

use crate::wire::Wire;

/// Runs checks on a station with node-ID 5.
fn judge<S: Station + 'static>(
    wire: &Wire<S>,
    sheet: Option<eds::Eds>,
    profile: Option<Profile>,
    only: &[&str],
) -> Run {
    judge_over(&mut wire.network(), sheet, profile, only)
}

/// Runs checks on the device with node-ID 5 of a network.
fn judge_over(
    network: &mut Network,
    sheet: Option<eds::Eds>,
    profile: Option<Profile>,
    only: &[&str],
) -> Run {
    let setup = Setup {
        node: canopen::NodeId::new(5).expect("a node-ID"),
        sheet,
        timeout: canopen::Duration::from_millis(500),
        boot: canopen::Duration::from_millis(2000),
    };
    let mut checks = check::all(profile);
    checks.retain(|check| only.is_empty() || only.iter().any(|text| check.is_meant(text)));
    let options = check::Options { checks, allowed: Effect::Stores };
    let mut subject = Subject::new(network, setup);
    match check::run(&mut subject, &options, |_| ()) {
        Ok(run) => run,
        Err(stop) => panic!("{stop:?}"),
    }
}

/// The checks that did not pass, in words.
fn complaints(run: &Run) -> Vec<String> {
    let complaint = |result: &check::Result| match &result.verdict {
        Verdict::Passed => None,
        Verdict::Skipped(reason) => Some(format!("{} skipped: {reason}", result.check.id)),
        Verdict::Failed(deviation) | Verdict::Recommended(deviation) => Some(format!(
            "{} {}: expected {}, seen {}",
            result.check.id,
            result.verdict.word(),
            deviation.expected,
            deviation.seen
        )),
    };
    run.results.iter().filter_map(complaint).collect()
}
