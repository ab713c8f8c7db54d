//! Tests that the personalities of this project conform, each with its profile.

use node::Personality;
use nodectl::check::Profile;

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
fn a_configured_node_conforms_and_keeps_what_it_has_saved() {
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
