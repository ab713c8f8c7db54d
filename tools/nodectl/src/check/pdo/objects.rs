//! Checks of the communication parameters of PDOs.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "PDO-01",
        "RPDO communication parameters have their sizes",
        "CiA 301, 7.5.2.35",
        parameters::<RPDO>,
    ),
    Check::new(
        "PDO-02",
        "TPDO communication parameters have their sizes",
        "CiA 301, 7.5.2.37",
        parameters::<TPDO>,
    ),
    Check::new(
        "PDO-03",
        "The first four RPDOs have the predefined CAN-IDs",
        "CiA 301, 7.3.5",
        predefined::<RPDO>,
    )
    .stores(),
    Check::new(
        "PDO-04",
        "The first four TPDOs have the predefined CAN-IDs",
        "CiA 301, 7.3.5",
        predefined::<TPDO>,
    )
    .stores(),
    Check::new("PDO-05", "A TPDO refuses restricted CAN-IDs", "CiA 301, 7.3.5", restricted::<TPDO>),
    Check::new("PDO-06", "An RPDO refuses restricted CAN-IDs", "CiA 301, 7.3.5", restricted::<RPDO>),
    Check::new(
        "PDO-07",
        "The CAN-ID of a TPDO is locked while it is valid",
        "CiA 301, 7.5.2.37",
        locked_id::<TPDO>,
    ),
    Check::new(
        "PDO-08",
        "The CAN-ID of an RPDO is locked while it is valid",
        "CiA 301, 7.5.2.35",
        locked_id::<RPDO>,
    ),
    Check::new(
        "PDO-09",
        "The inhibit time is locked while the TPDO is valid",
        "CiA 301, 7.5.2.37",
        locked_inhibit,
    ),
    Check::new(
        "PDO-10",
        "Reserved transmission types are refused: TPDO",
        "CiA 301, table 72",
        reserved_types::<TPDO>,
    ),
    Check::new(
        "PDO-11",
        "Reserved transmission types are refused: RPDO",
        "CiA 301, table 68",
        reserved_types::<RPDO>,
    ),
    Check::new("PDO-12", "Sub-index 4 is reserved and absent", "CiA 301, 7.5.2.37", reserved_sub),
    Check::new("PDO-13", "A TPDO that is not valid is not sent", "CiA 301, 7.5.2.37", invalid),
    Check::new("PDO-14", "A TPDO is sent with the CAN-ID that it was given", "CiA 301, 7.5.2.37", moved),
    Check::new(
        "PDO-15",
        "Reset communication brings back the transmission type",
        "CiA 301, 7.3.2.2.1",
        type_returns,
    )
    .resets(),
    Check::new(
        "PDO-16",
        "The SYNC start value is locked while the TPDO is valid",
        "CiA 301, 7.5.2.37",
        locked_start,
    ),
];

fn parameters<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdos = s.pdos(FIRST)?;
    for index in &pdos {
        for (sub, bytes) in [(0, 1), (1, 4), (2, 1)] {
            let value = s.read(*index, sub)?;
            ensure(
                value.len() == bytes,
                format!("{bytes} bytes in {index:04X}h:{sub}"),
                format!("{value:02X?}"),
            )?;
        }
        for (sub, bytes) in [(3, 2), (5, 2), (6, 1)] {
            if let Ok(value) = s.try_read(*index, sub)? {
                ensure(
                    value.len() == bytes,
                    format!("{bytes} bytes in {index:04X}h:{sub}"),
                    format!("{value:02X?}"),
                )?;
            }
        }
    }
    if pdos.is_empty() { Err(skip("the device has no such PDO")) } else { Ok(()) }
}

fn predefined<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdos: Vec<u16> = s.pdos(FIRST)?.into_iter().filter(|index| index - FIRST < 4).collect();
    let profile = s.number(0x1000, 0)? & 0xFFFF;
    if pdos.is_empty() || profile == 417 {
        return Err(skip("the device has no such PDO, or its profile has CAN-IDs of its own"));
    }
    let base = if FIRST == TPDO { 0x180 } else { 0x200 };
    s.with_defaults(|s| {
        for index in pdos {
            let expected = base + 0x100 * u32::from(index - FIRST) + u32::from(s.id());
            let value = s.number(index, 1)?;
            // A PDO that is off may have no CAN-ID at all.
            let is_good = value & 0x7FF == expected || value & OFF != 0 && value & 0x7FF == 0;
            ensure(is_good, format!("CAN-ID {expected:03X}h in {index:04X}h:1"), format!("{value:08X}h"))?;
        }
        Ok(())
    })
}

fn restricted<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.pdo(FIRST)?;
    for id in [0x000, 0x07F, 0x101, 0x180, 0x580 + u32::from(s.id()), 0x600 + u32::from(s.id()), 0x6E0, 0x701]
    {
        let value = pdo.cob_id & !0x7FF | id;
        s.refuses(pdo.index, 1, value, &[abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW, abort::PARAMETER])?;
    }
    Ok(())
}

/// Abort codes for a locked object: CiA 301 names no code.
const LOCKED: [u32; 6] =
    [abort::VALUE, abort::STATE, abort::LOCAL, abort::ACCESS, abort::PARAMETER, abort::GENERAL];

fn valid<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome<super::super::subject::Pdo> {
    let pdo = s.pdo(FIRST)?;
    s.fill(pdo)?;
    s.switch_on(pdo)?;
    Ok(pdo)
}

fn locked_id<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdo = valid::<FIRST>(s)?;
    s.refuses(pdo.index, 1, pdo.cob_id & !0x7FF | 0x6D2, &LOCKED)
}

fn locked_inhibit(s: &mut Subject<'_>) -> Outcome {
    let pdo = valid::<TPDO>(s)?;
    s.need(pdo.index, 3)?;
    let value = s.number(pdo.index, 3)?;
    s.refuses(pdo.index, 3, value ^ 100, &LOCKED)
}

fn locked_start(s: &mut Subject<'_>) -> Outcome {
    let pdo = valid::<TPDO>(s)?;
    s.need(pdo.index, 6)?;
    let value = s.number(pdo.index, 6)?;
    s.refuses(pdo.index, 6, value ^ 3, &LOCKED)
}

fn reserved_types<const FIRST: u16>(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.pdo(FIRST)?;
    for value in [241, 251] {
        s.refuses(pdo.index, 2, value, &[abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW])?;
    }
    Ok(())
}

fn reserved_sub(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.pdo(TPDO)?;
    s.hides(pdo.index, 4, &[abort::NO_SUB_INDEX])
}

fn invalid(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(254, 50)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    s.pass(300)?;
    let count = s.heard(mark, pdo.id()).len();
    ensure(count == 0, "no frame of a TPDO whose bit 31 is set", format!("{count}"))
}

fn moved(s: &mut Subject<'_>) -> Outcome {
    let mut pdo = s.tpdo(254, 50)?;
    pdo.cob_id = pdo.cob_id & !0x7FF | 0x6D3;
    s.set_if_supported(pdo.index, 1, pdo.cob_id | OFF)?;
    let count = s.count(pdo, State::Operational, 500)?;
    ensure(count >= 8, "a frame with CAN-ID 6D3h each 50 ms", format!("{count} in 500 ms"))
}

fn type_returns(s: &mut Subject<'_>) -> Outcome {
    s.reset(Command::ResetCommunication)?;
    let index = *s.pdos(TPDO)?.first().ok_or_else(|| skip("the device has no TPDO"))?;
    let before = s.number(index, 2)?;
    s.pdo(TPDO)?;
    s.set_if_supported(index, 2, if before == 1 { 2 } else { 1 })?;
    s.reset(Command::ResetCommunication)?;
    s.holds(index, 2, before)
}
