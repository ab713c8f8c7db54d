//! Tests that the device without a fault passes every check, and that no check is skipped.

use nodectl::check::Profile;

use super::device::sheet;
use super::faulty::Faulty;
use crate::wire::Wire;

use super::{complaints, judge};

#[test]
fn the_device_without_a_fault_passes_every_check() {
    for profile in std::iter::once(None).chain(Profile::ALL.map(Some)) {
        let run =
            judge(&Wire::new(Faulty::new(profile, Box::new(|_| ()))), Some(sheet(profile)), profile, &[]);
        let complaints: Vec<String> = complaints(&run)
            .into_iter()
            .filter(|text| !text.contains("its profile has CAN-IDs of its own"))
            .collect();
        assert_eq!((complaints, run.left_behind), (vec![], vec![]), "{profile:?}");
    }
}
