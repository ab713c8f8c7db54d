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
