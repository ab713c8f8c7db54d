//! `cargo xtask bringup` with the emulated board: green without a fault, and red with the right words for each fault.

use bringup::chip::Chip;
use bringup::report::{Report, Result, StepReport};
use bringup::run::{self, Effort, Subject};
use bringup::steps;
use canopen::NodeId;
use workbench::bringup::faults::{self, Fault};
use workbench::bringup::{EmulatedDesk, world};

use crate::support::images;

fn subject() -> Subject {
    let (node, chip) = (NodeId::new(1).unwrap(), Chip::named("STM32F446RETx").unwrap());
    Subject { node, chip, kbit: 1000 }
}

fn desk(flags: &str) -> EmulatedDesk {
    EmulatedDesk::new(world(&images(), "encoder", flags).unwrap(), &images()).unwrap()
}

/// Takes a healthy board through all steps. Step 13 is skipped by a personality without an encoder.
fn is_green(desk: &mut EmulatedDesk, subject: Subject, has_encoder: bool) {
    let chosen: Vec<_> = steps::ALL.iter().collect();
    let (mut report, mut said) = (Report::default(), String::new());
    let tell = |step: &StepReport, _: &Report| said.push_str(&step.text());
    let result = run::all(&chosen, desk, subject, Effort::SHORT, &mut report, tell);
    println!("{said}");
    assert_eq!((result, report.steps.len()), (Result::Green, 15), "{said}");
    for step in &report.steps {
        let expected = if step.number == 13 && !has_encoder { Result::Skipped } else { Result::Green };
        assert_eq!(step.result, expected, "step {}: {said}", step.number);
    }
}

fn is_green_as(personality: &str, has_encoder: bool) {
    let world = world(&images(), personality, "").unwrap();
    is_green(&mut EmulatedDesk::new(world, &images()).unwrap(), subject(), has_encoder);
}

#[test]
fn all_steps_are_green_with_a_healthy_pressure_transmitter() {
    is_green_as("pressure", false);
}

#[test]
fn all_steps_are_green_with_a_healthy_combined_device() {
    is_green_as("combined", true);
}

#[test]
fn all_steps_are_green_with_a_healthy_lift_device() {
    is_green_as("lift", false);
}

#[test]
#[ignore = "the images come with `cargo xtask test --thorough`"]
fn all_steps_are_green_with_the_boards_of_the_other_chips() {
    // The emulated chips have 1 MiB of flash.
    for (chip, name) in [("stm32f405", "STM32F405RGTx"), ("stm32f407", "STM32F407VGTx")] {
        let images = images().join(chip);
        let subject = Subject { chip: Chip::named(name).unwrap(), ..subject() };
        for (personality, has_encoder) in [("encoder", true), ("pressure", false)] {
            let world = world(&images, personality, &format!("--chip {chip}")).unwrap();
            is_green(&mut EmulatedDesk::new(world, &images).unwrap(), subject, has_encoder);
        }
    }
}

#[test]
fn all_steps_are_green_with_a_healthy_encoder() {
    is_green_as("encoder", true);
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

/// An interrupted run continues with the first step that is not green.
#[test]
fn a_second_run_continues_at_the_failed_step() {
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
