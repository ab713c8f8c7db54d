//! Tests that the personalities of this project conform, each with its profile.

use canopen::Duration;
use node::Personality;
use nodectl::bus::Bus;
use nodectl::check::{self, Profile, Run, Setup, Subject};

use super::{complaints, judge};
use crate::commands::printed;
use crate::pressure::Pressure;
use crate::wire::Wire;

const fn profile(personality: Personality) -> Profile {
    match personality {
        Personality::Pressure => Profile::Measuring,
        Personality::Encoder | Personality::Combined => Profile::Encoder,
        Personality::Lift => Profile::Lift,
    }
}

#[test]
fn own_personalities_conform() {
    for device in eds::DEVICES {
        let wire = Wire::new(Pressure::of(device.personality, 5));
        if device.personality == Personality::Lift {
            // A new lift node has no virtual device yet, and its PDOs are off.
            printed(&wire, &["write", "--node", "5", "2305", "15"]);
            printed(&wire, &["save", "--node", "5"]);
        }
        let run = judge(&wire, Some(device.eds().clone()), Some(profile(device.personality)), &[]);
        let lines = complaints(&run).join("\n");
        assert_eq!(
            (run.count("failed"), &run.left_behind[..]),
            (0, &[][..]),
            "{}:\n{lines}",
            device.file_name
        );
        assert!(run.count("passed") > 150, "{}:\n{lines}", device.file_name);
    }
}

/// A device that a user has configured and saved: SYNC with counter and period, another CAN-ID of EMCY and of SYNC.
#[test]
fn a_configured_node_conforms_and_keeps_its_saved_values() {
    let sheet =
        || eds::DEVICES.iter().find(|device| device.personality == Personality::Pressure).unwrap().eds();
    for settings in [
        &[("1019", "10"), ("1006", "2000000"), ("1016:1", "0x00060100")][..],
        &[("1006", "2000000"), ("1016:1", "0x00060100"), ("1016:2", "0x00070100")],
        &[("1014", "0x80000085"), ("1014", "0x90"), ("1016:1", "0x00060100")],
        &[("1005", "0x90"), ("1019", "20"), ("1017", "700")],
    ] {
        let wire = Wire::new(Pressure::of(Personality::Pressure, 5));
        for (object, value) in settings {
            printed(&wire, &["write", object, value, "--node", "5"]);
        }
        printed(&wire, &["save", "--node", "5"]);
        let dump = || printed(&wire, &["dump", "--node", "5"]);
        let before = dump();
        let run = judge(
            &wire,
            Some(sheet().clone()),
            Some(Profile::Measuring),
            &["STO", "SYN", "EMC", "ERR", "PDO"],
        );
        let lines = complaints(&run).join("\n");
        assert_eq!((run.count("failed"), &run.left_behind[..]), (0, &[][..]), "{settings:?}:\n{lines}");
        assert_eq!(dump(), before, "{settings:?}");
        printed(&wire, &["nmt", "reset", "--node", "5"]);
        assert_eq!(dump(), before, "what was saved is saved, {settings:?}");
    }
}

/// An interruption at any time: while a check listens, while it has changed PDOs, and while it has restored the defaults.
#[test]
fn an_interrupted_run_restores_the_values_of_the_node() {
    for (device, step) in eds::DEVICES.iter().zip([1_700, 1_900, 2_300, 2_900]) {
        let wire = Wire::new(Pressure::of(device.personality, 5));
        if device.personality == Personality::Lift {
            printed(&wire, &["write", "--node", "5", "2305", "15"]);
        }
        printed(&wire, &["write", "--node", "5", "1017", "700"]);
        printed(&wire, &["save", "--node", "5"]);
        let dump = || printed(&wire, &["dump", "--node", "5"]);
        let before = dump();
        let mut interrupted = 0;
        for only in ["PDO", "STO", "EMC", "ERR"] {
            for time in (0..60).map(|number| number * step) {
                let run = interrupted_run(&wire, device, only, time);
                assert_eq!((run.count("failed"), &run.left_behind[..]), (0, &[][..]), "{only} at {time} ms");
                assert_eq!(dump(), before, "{:?}, {only} at {time} ms", device.personality);
                printed(&wire, &["nmt", "reset", "--node", "5"]);
                assert_eq!(dump(), before, "saved, {:?}, {only} at {time} ms", device.personality);
                if !run.is_interrupted {
                    break;
                }
                interrupted += 1;
            }
        }
        assert!(interrupted > 20, "{:?}: {interrupted} runs were interrupted", device.personality);
    }
}

/// Runs some checks, and interrupts them after a time on the bus.
fn interrupted_run(wire: &Wire<Pressure>, device: &eds::Device, only: &str, time: u64) -> Run {
    let clock = wire.clone();
    let end = clock.now() + Duration::from_millis(time);
    let mut network = wire.network();
    let setup = Setup {
        node: canopen::NodeId::new(5).expect("a node-ID"),
        sheet: Some(device.eds().clone()),
        timeout: Duration::from_millis(500),
        boot: Duration::from_millis(2000),
    };
    let mut checks = check::all(Some(profile(device.personality)));
    checks.retain(|check| check.is_meant(only));
    let options = check::Options { checks, allowed: check::Effect::Stores };
    let mut subject = Subject::new(&mut network, setup).with_interruption(move || clock.now() >= end);
    check::run(&mut subject, &options, |_| ()).expect("a run")
}
