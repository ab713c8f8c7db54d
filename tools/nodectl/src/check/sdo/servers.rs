//! Checks of objects 1200h to 12FFh, the COB-IDs of SDO servers and clients.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("SDO-80", "1200h shows the predefined COB-IDs", "CiA 301, 7.5.2.32", first),
    Check::new(
        "SDO-81",
        "1201h to 127Fh are present, or properly absent",
        "CiA 301, 7.5.2.32",
        present_or_absent,
    ),
    Check::new(
        "SDO-82",
        "COB-IDs of additional servers return with reset communication",
        "CiA 301, 7.3.2.2",
        return_after_reset,
    )
    .resets(),
    Check::new("SDO-83", "1200h cannot be written", "CiA 301, 7.5.2.32", constant),
];

fn first(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1200, 1)?;
    let own = u32::from(s.id());
    s.holds(0x1200, 1, 0x600 + own)?;
    s.holds(0x1200, 2, 0x580 + own)
}

fn present_or_absent(s: &mut Subject<'_>) -> Outcome {
    for index in 0x1201..=0x127F {
        match s.try_read(index, 1)? {
            Ok(bytes) => {
                ensure(bytes.len() == 4, format!("four bytes in {index:04X}h:1"), format!("{bytes:02X?}"))?;
            }
            Err(Refusal(abort::NO_OBJECT)) => (),
            Err(refusal) => {
                return Err(fail(format!("a value or abort 0602 0000h for {index:04X}h:1"), refusal));
            }
        }
    }
    Ok(())
}

fn return_after_reset(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1201, 1)?;
    s.reset(Command::ResetCommunication)?;
    let before = s.number(0x1201, 1)?;
    s.set(0x1201, 1, before | OFF)?;
    s.set(0x1201, 1, OFF | 0x680)?;
    s.reset(Command::ResetCommunication)?;
    s.holds(0x1201, 1, before)
}

fn constant(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1200, 1)?;
    s.refuses(0x1200, 1, 0x601, &[abort::READ_ONLY])
}
