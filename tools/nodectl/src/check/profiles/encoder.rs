//! Checks of CiA 406: the objects of both classes.

use super::super::prelude::*;
use super::{has, names, one_is_sent};

pub(super) const CHECKS: &[Check] = &[
    Check::new("P406-01", "1000h names CiA 406", "CiA 406, device type", names::<406>),
    Check::new("P406-02", "6000h: operating parameters", "CiA 406, object 6000h", has::<0x6000, 0, 2>),
    Check::new(
        "P406-03",
        "A position value that a TPDO can carry",
        "CiA 406, objects 6004h and 6020h",
        position,
    ),
    Check::new("P406-04", "6500h: operating status", "CiA 406, object 6500h", has::<0x6500, 0, 2>),
    Check::new(
        "P406-05",
        "6501h: resolution or measuring step",
        "CiA 406, object 6501h",
        has::<0x6501, 0, 4>,
    ),
    Check::new("P406-06", "6502h: number of revolutions", "CiA 406, object 6502h", has::<0x6502, 0, 2>),
    Check::new("P406-07", "6500h shows the operating parameters of 6000h", "CiA 406, object 6500h", status)
        .recommended(),
    Check::new("P406-08", "The position value cannot be written", "CiA 406, object 6004h", read_only),
    Check::new("P406-09", "6030h has as many channels as 6020h", "CiA 406, object 6030h", speeds),
];

fn speeds(s: &mut Subject<'_>) -> Outcome {
    s.need(0x6030, 1)?;
    s.need(0x6020, 1)?;
    let channels = s.number(0x6020, 0)?;
    s.holds(0x6030, 0, channels)
}

fn position(s: &mut Subject<'_>) -> Outcome {
    one_is_sent(s, &[(0x6004, 0), (0x6020, 1)], "a position value")
}

fn status(s: &mut Subject<'_>) -> Outcome {
    // The bits of code sequence and scaling.
    let (parameters, status) = (s.number(0x6000, 0)? & 0b101, s.number(0x6500, 0)? & 0b101);
    ensure(parameters == status, format!("bits 0 and 2 as in 6000h: {parameters:b}"), format!("{status:b}"))
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    s.need(0x6004, 0)?;
    s.refuses(0x6004, 0, 0, &[abort::READ_ONLY])
}
