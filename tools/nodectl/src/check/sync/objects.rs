//! Checks of 1005h, 1006h, 1007h and 1019h.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("SYN-01", "1005h is 80h by default", "CiA 301, 7.5.2.5", default_id),
    Check::new("SYN-02", "1005h refuses restricted CAN-IDs", "CiA 301, 7.3.5", restricted),
    Check::new("SYN-03", "1005h takes another CAN-ID, and SYNC is taken with it", "CiA 301, 7.5.2.5", moved),
    Check::new("SYN-04", "1019h refuses 1", "CiA 301, 7.5.2.22", overflow::<1>),
    Check::new("SYN-05", "1019h refuses 241", "CiA 301, 7.5.2.22", overflow::<241>),
    Check::new("SYN-06", "1019h refuses 255", "CiA 301, 7.5.2.22", overflow::<255>),
    Check::new("SYN-07", "1019h takes 2 and 240", "CiA 301, 7.5.2.22", takes),
    Check::new("SYN-08", "1019h is locked while 1006h is not 0", "CiA 301, 7.5.2.22", locked),
    Check::new("SYN-09", "1006h takes a period", "CiA 301, 7.5.2.6", period),
    Check::new("SYN-10", "1007h takes a window", "CiA 301, 7.5.2.7", window),
    Check::new("SYN-11", "1005h refuses 29-bit identifiers, or keeps them", "CiA 301, 7.5.2.5", extended),
];

fn default_id(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1005, 0)?;
    let is_default = |value: u32| value & 0x1FFF_FFFF == 0x80;
    let value = s.number(0x1005, 0)?;
    if is_default(value) {
        return Ok(());
    }
    s.with_default_of((0x1005, 0), 0x80, |s| {
        let value = s.number(0x1005, 0)?;
        ensure(is_default(value), "CAN-ID 80h", format!("{value:08X}h"))
    })
}

fn restricted(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1005, 0)?;
    for id in [0x000, 0x07F, 0x101, 0x180, 0x580 + u32::from(s.id()), 0x600 + u32::from(s.id()), 0x6E0, 0x701]
    {
        s.refuses(0x1005, 0, id, &[abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW, abort::PARAMETER])?;
    }
    Ok(())
}

fn moved(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.need(0x1005, 0)?;
    let pdo = s.tpdo(1, 0)?;
    s.set_if_supported(0x1005, 0, 0x6D1)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    for _ in 0..3 {
        s.send(0x6D1, &[])?;
        s.pass(50)?;
    }
    let count = s.heard(mark, pdo.id()).len();
    ensure(count == 3, "a TPDO with each of three SYNC of CAN-ID 6D1h", format!("{count}"))
}

fn overflow<const VALUE: u32>(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1019, 0)?;
    s.unlock_counter()?;
    s.refuses(0x1019, 0, VALUE, &[abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW])
}

fn takes(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1019, 0)?;
    s.unlock_counter()?;
    for value in [2, 240] {
        s.set(0x1019, 0, value)?;
        s.holds(0x1019, 0, value)?;
    }
    Ok(())
}

fn locked(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1019, 0)?;
    s.need(0x1006, 0)?;
    s.unlock_counter()?;
    s.set(0x1019, 0, 0)?;
    s.set(0x1006, 0, 1_000_000)?;
    s.refuses(0x1019, 0, 10, &[abort::STATE, abort::PARAMETER])
}

fn period(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1006, 0)?;
    s.set(0x1006, 0, 500_000)?;
    s.holds(0x1006, 0, 500_000)?;
    s.set(0x1006, 0, 0)
}

fn window(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1007, 0)?;
    s.set(0x1007, 0, 20_000)?;
    s.holds(0x1007, 0, 20_000)
}

fn extended(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1005, 0)?;
    match s.change(0x1005, 0, &0x2000_0080_u32.to_le_bytes())? {
        Ok(()) => s.holds(0x1005, 0, 0x2000_0080),
        Err(Refusal(abort::VALUE | abort::TOO_HIGH | abort::TOO_LOW | abort::PARAMETER)) => Ok(()),
        Err(refusal) => Err(fail("abort 0609 0030h, or the value in 1005h", refusal)),
    }
}
