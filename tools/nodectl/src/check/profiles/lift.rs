//! Checks of CiA 417: the objects of every lift device.

use super::super::prelude::*;
use super::{has, names};

pub(super) const CHECKS: &[Check] = &[
    Check::new("P417-01", "1000h names CiA 417", "CiA 417-1, device type", names::<417>),
    Check::new("P417-02", "6000h tells the virtual devices", "CiA 417-2, object 6000h", has::<0x6000, 0, 1>),
    Check::new("P417-03", "6000h:1 can be read", "CiA 417-2, object 6000h", has::<0x6000, 1, 2>),
    Check::new("P417-04", "6001h tells the lift", "CiA 417-2, object 6001h", lift_number),
    Check::new("P417-05", "A PDO of the lift is there", "CiA 417-3", pdos),
    Check::new("P417-06", "63B0h: area state of position unit 1", "CiA 417-4, object 63B0h", area_state),
    Check::new(
        "P417-07",
        "63B4h and 63B8h: limits of position unit 1",
        "CiA 417-4, objects 63B4h and 63B8h",
        limits,
    ),
];

fn area_state(s: &mut Subject<'_>) -> Outcome {
    s.need(0x63B0, 1)?;
    has::<0x63B0, 1, 1>(s)
}

fn limits(s: &mut Subject<'_>) -> Outcome {
    s.need(0x63B4, 1)?;
    has::<0x63B4, 1, 4>(s)?;
    has::<0x63B8, 1, 4>(s)
}

fn lift_number(s: &mut Subject<'_>) -> Outcome {
    let number = s.number(0x6001, 0)?;
    ensure(number <= 0xFF, "a lift in one byte", format!("{number:X}h"))
}

/// The PDOs that CiA 417 defines, beyond the four of the pre-defined connection set.
fn pdos(s: &mut Subject<'_>) -> Outcome {
    let sheet = s.sheet()?;
    let is_one = |index: u16| matches!(index, 0x1400..=0x15FF | 0x1800..=0x19FF);
    ensure(sheet.objects.keys().any(|index| is_one(*index)), "a PDO", "none in the data sheet")
}
