//! Checks of CiA 404: analogue input function blocks.

use super::super::prelude::*;
use super::{has, names, one_is_sent};

pub(super) const CHECKS: &[Check] = &[
    Check::new("P404-01", "1000h names CiA 404", "CiA 404-1, device type", names::<404>),
    Check::new(
        "P404-02",
        "The input has a process value that a TPDO can carry",
        "CiA 404-1, AI input PV",
        value,
    ),
    Check::new("P404-03", "6110h: sensor type", "CiA 404-1, AI sensor type", has::<0x6110, 1, 2>),
    Check::new(
        "P404-04",
        "6131h: physical unit of the process value",
        "CiA 404-1, AI physical unit PV",
        has::<0x6131, 1, 4>,
    ),
    Check::new(
        "P404-05",
        "6132h: decimal digits of the process value",
        "CiA 404-1, AI decimal digits PV",
        has::<0x6132, 1, 1>,
    ),
    Check::new("P404-06", "6150h: status of the input", "CiA 404-1, AI status", has::<0x6150, 1, 1>),
    Check::new(
        "P404-07",
        "The objects of the input have as many channels as 6110h",
        "CiA 404-1, AI function block",
        channels,
    ),
    Check::new("P404-08", "6139h: autotare refuses another signature", "CiA 404-1, AI autotare", signature),
    Check::new("P404-09", "6600h:1 has the alarm states of 650Dh", "CiA 404-1, alarm function block", alarms),
];

fn signature(s: &mut Subject<'_>) -> Outcome {
    s.need(0x6139, 1)?;
    let codes = [abort::NOT_STORED, abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW];
    s.refuses_bytes(0x6139, 1, &[0; 4], &codes)
}

fn alarms(s: &mut Subject<'_>) -> Outcome {
    s.need(0x6600, 1)?;
    let mut states = 0;
    for alarm in 1..=8 {
        let state = s.optional(0x650D, alarm)?.unwrap_or(0);
        states |= (state & 1) << (alarm - 1);
    }
    s.holds(0x6600, 1, states)
}

fn value(s: &mut Subject<'_>) -> Outcome {
    one_is_sent(s, &[(0x6130, 1), (0x7130, 1), (0x9130, 1)], "a process value")
}

fn channels(s: &mut Subject<'_>) -> Outcome {
    let expected = s.number(0x6110, 0)?;
    for index in [0x6131, 0x6132, 0x6150] {
        s.holds(index, 0, expected)?;
    }
    Ok(())
}
