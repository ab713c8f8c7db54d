//! Checks of the signatures that protect saving and restoring.

use super::super::prelude::*;

const SAVE: u16 = 0x1010;
const RESTORE: u16 = 0x1011;

pub(super) const CHECKS: &[Check] = &[
    Check::new("STO-01", "1010h refuses a wrong signature", "CiA 301, 7.5.2.13", wrong::<SAVE>),
    Check::new("STO-02", "1011h refuses a wrong signature", "CiA 301, 7.5.2.14", wrong::<RESTORE>),
    Check::new("STO-03", "1010h refuses the signature backwards", "CiA 301, 7.5.2.13", backwards::<SAVE>),
    Check::new("STO-04", "1011h refuses the signature backwards", "CiA 301, 7.5.2.14", backwards::<RESTORE>),
    Check::new("STO-05", "1010h refuses the signature of 1011h", "CiA 301, 7.5.2.13", other::<SAVE>),
    Check::new("STO-06", "1011h refuses the signature of 1010h", "CiA 301, 7.5.2.14", other::<RESTORE>),
    Check::new("STO-07", "1010h tells how the device saves", "CiA 301, 7.5.2.13", tells::<SAVE>),
    Check::new("STO-08", "1011h tells whether the device restores", "CiA 301, 7.5.2.14", tells::<RESTORE>),
];

fn refuses<const INDEX: u16>(s: &mut Subject<'_>, signature: [u8; 4]) -> Outcome {
    s.need(INDEX, 1)?;
    for sub in 1..=u8::try_from(s.number(INDEX, 0)?).unwrap_or(1) {
        if s.try_read(INDEX, sub)?.is_err() {
            continue;
        }
        match s.try_write(INDEX, sub, &signature)? {
            Err(Refusal(abort::NOT_STORED | abort::LOCAL)) => (),
            other => {
                return Err(fail(format!("abort 0800 0020h from {INDEX:04X}h:{sub}"), format!("{other:X?}")));
            }
        }
    }
    Ok(())
}

fn wrong<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    refuses::<INDEX>(s, [0, 0, 0, 0])?;
    refuses::<INDEX>(s, *b"SAVE")
}

fn backwards<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    refuses::<INDEX>(s, if INDEX == SAVE { *b"evas" } else { *b"daol" })
}

fn other<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    refuses::<INDEX>(s, if INDEX == SAVE { *b"load" } else { *b"save" })
}

fn tells<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    s.need(INDEX, 1)?;
    let value = s.number(INDEX, 1)?;
    let known = if INDEX == SAVE { 0b11 } else { 0b1 };
    ensure(value & !known == 0, format!("no bits but {known:b}"), format!("{value:08X}h"))
}
