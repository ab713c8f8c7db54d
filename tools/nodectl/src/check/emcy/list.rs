//! Checks of 1003h, the list of errors.

use super::super::prelude::*;
use super::provoke::{LIFE, heartbeat_is_back, lose_heartbeat, unused_node_id};

pub(super) const CHECKS: &[Check] = &[
    Check::new("EMC-40", "1003h:0 counts, and no entry beyond can be read", "CiA 301, 7.5.2.4", counts),
    Check::new("EMC-41", "1003h:1 has the code of the last EMCY", "CiA 301, 7.5.2.4", newest),
    Check::new("EMC-42", "1003h:0 takes 0 and the list is empty", "CiA 301, 7.5.2.4", clears),
    Check::new("EMC-43", "1003h:0 refuses any other value", "CiA 301, 7.5.2.4", refuses),
    Check::new("EMC-44", "An error is one more in 1003h:0", "CiA 301, 7.5.2.4", one_more),
    Check::new("EMC-45", "Older errors move down in 1003h", "CiA 301, 7.5.2.4", moves_down),
    Check::new("EMC-46", "1003h:1 cannot be written", "CiA 301, 7.5.2.4", read_only),
];

/// Abort codes of an empty place in the list: no data, or no such sub-index.
const EMPTY: [u32; 2] = [abort::NO_DATA, abort::NO_SUB_INDEX];

fn counts(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    let count =
        u8::try_from(s.number(0x1003, 0)?).map_err(|_| fail("a number of entries", "more than one byte"))?;
    for sub in 1..=count {
        s.read(0x1003, sub)?;
    }
    if count < 254 { s.hides(0x1003, count + 1, &EMPTY) } else { Ok(()) }
}

fn newest(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    let entry = s.number(0x1003, 1)?;
    ensure(entry & 0xFFFF == u32::from(LIFE), "8130h in the low word", format!("{entry:08X}h"))
}

fn clears(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    heartbeat_is_back(s, node)?;
    s.try_write(0x1003, 0, &[0])?.map_err(|refusal| fail("1003h:0 takes 0", refusal))?;
    s.holds(0x1003, 0, 0)?;
    s.hides(0x1003, 1, &EMPTY)
}

fn refuses(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    for value in [1_u8, 0xFF] {
        match s.try_write(0x1003, 0, &[value])? {
            Err(Refusal(abort::VALUE | abort::TOO_HIGH)) => (),
            other => return Err(fail("abort 0609 0030h", format!("{other:X?}"))),
        }
    }
    Ok(())
}

fn one_more(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    s.try_write(0x1003, 0, &[0])?.map_err(|refusal| fail("1003h:0 takes 0", refusal))?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    s.holds(0x1003, 0, 1)
}

fn moves_down(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    s.need(0x1003, 2).or_else(|stop| if matches!(stop, Stop::Skipped(_)) { Ok(()) } else { Err(stop) })?;
    s.try_write(0x1003, 0, &[0])?.map_err(|refusal| fail("1003h:0 takes 0", refusal))?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    let first = s.number(0x1003, 1)?;
    heartbeat_is_back(s, node)?;
    lose_heartbeat(s, node)?;
    if s.number(0x1003, 0)? < 2 {
        return Err(skip("the list has one entry"));
    }
    let last = s.number(0x1003, 0)?;
    s.holds(0x1003, u8::try_from(last).unwrap_or(1), first)
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1003, 0)?;
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    s.refuses(0x1003, 1, 0, &[abort::READ_ONLY])
}
