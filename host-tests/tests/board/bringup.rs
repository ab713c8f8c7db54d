//! `cargo xtask bringup` with the emulated board: green without a fault, and red with the right words for each fault.

use bringup::chip::Chip;
use bringup::report::{Report, Result, StepReport};
use bringup::run::{self, Effort, Subject};
use bringup::steps;
use bringup_emulated::faults::{self, Fault};
use bringup_emulated::{EmulatedDesk, world};
use canopen::NodeId;

use crate::support::images;

fn subject() -> Subject {
    let (node, chip) = (NodeId::new(1).unwrap(), Chip::named("STM32F446RETx").unwrap());
    Subject { node, chip, kbit: 1000 }
}

fn desk(flags: &str) -> EmulatedDesk {
    EmulatedDesk::new(world(&images(), flags).unwrap(), &images()).unwrap()
}

#[test]
fn all_steps_are_green_with_a_healthy_board() {
    let chosen: Vec<_> = steps::ALL.iter().collect();
    let (mut report, mut said) = (Report::default(), String::new());
    let tell = |step: &StepReport, _: &Report| said.push_str(&step.text());
    let result = run::all(&chosen, &mut desk(""), subject(), Effort::SHORT, &mut report, tell);
    println!("{said}");
    assert_eq!((result, report.steps.len()), (Result::Green, 15), "{said}");
    assert!(report.steps.iter().all(|step| step.result == Result::Green), "{said}");
}

/// The words of the checks that are red.
fn red(step: &StepReport) -> Vec<String> {
    let red = step.checks.iter().filter(|check| check.result == Result::Red);
    red.map(|check| format!("{}: {}", check.what, check.seen)).collect()
}

fn run_with(fault: &Fault) -> StepReport {
    let mut desk = desk(fault.flags());
    fault.bring(&mut desk);
    run::step(steps::named(fault.step).unwrap(), &mut desk, subject(), Effort::SHORT)
}

#[test]
fn each_fault_of_the_hardware_is_named() {
    let mut wrong = Vec::new();
    for fault in &faults::ALL {
        let step = run_with(fault);
        let red = red(&step);
        if !red.iter().any(|line| line.contains(fault.says)) {
            wrong.push(format!("{}: step {} says {red:?}", fault.name, fault.step));
        }
        assert!(
            step.checks.iter().all(|check| check.result != Result::Red || !check.remedy.is_empty()),
            "{}",
            fault.name
        );
    }
    assert_eq!(wrong, [""; 0]);
}

/// A run that was interrupted goes on with the first step that is not green.
#[test]
fn a_second_run_goes_on_at_the_step_that_was_red() {
    let fault = faults::ALL.iter().find(|fault| fault.name.contains("ppm")).unwrap();
    let chosen: Vec<_> = steps::ALL[..4].iter().collect();
    let mut report = Report::default();
    let mut broken = desk(fault.flags());
    let first = run::all(&chosen, &mut broken, subject(), Effort::SHORT, &mut report, |_, _| ());
    assert_eq!((first, report.steps.last().unwrap().name.as_str()), (Result::Red, "clock"));
    let mut again = Vec::new();
    let tell = |step: &StepReport, _: &Report| again.push(step.number);
    let second = run::all(&chosen, &mut desk(""), subject(), Effort::SHORT, &mut report, tell);
    assert_eq!((second, again), (Result::Green, vec![4]));
}
