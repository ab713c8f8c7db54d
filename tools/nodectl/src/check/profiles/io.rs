//! Checks of CiA 401: the inputs and outputs that 1000h announces.

use super::super::prelude::*;
use super::names;

pub(super) const CHECKS: &[Check] = &[
    Check::new("P401-01", "1000h names CiA 401", "CiA 401-1, device type", names::<401>),
    Check::new("P401-02", "1000h tells an input or an output", "CiA 401-1, device type", tells),
    Check::new("P401-03", "Digital inputs are in 6000h", "CiA 401-1, object 6000h", block::<16, 0x6000>),
    Check::new("P401-04", "Digital outputs are in 6200h", "CiA 401-1, object 6200h", block::<17, 0x6200>),
    Check::new("P401-05", "Analogue inputs are in 6401h", "CiA 401-1, object 6401h", block::<18, 0x6401>),
    Check::new("P401-06", "Analogue outputs are in 6411h", "CiA 401-1, object 6411h", block::<19, 0x6411>),
];

fn tells(s: &mut Subject<'_>) -> Outcome {
    let functions = s.number(0x1000, 0)? >> 16;
    ensure(functions & 0x1FF != 0, "a bit of 16 to 24 in 1000h", format!("{functions:04X}h in the high word"))
}

/// Where the bit of 1000h is set, the object must have at least one channel.
fn block<const BIT: u32, const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    if s.number(0x1000, 0)? & 1 << BIT == 0 {
        return Err(skip(format!("bit {BIT} of 1000h is 0")));
    }
    let channels = s.number(INDEX, 0)?;
    ensure(channels >= 1, format!("a channel in {INDEX:04X}h"), format!("{channels}"))?;
    s.read(INDEX, 1).map(drop)
}
