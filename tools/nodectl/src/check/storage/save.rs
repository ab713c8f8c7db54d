//! Checks that saved values survive a restart, and that other values do not.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("STO-20", "What is saved by 1010h:1 survives reset node", "CiA 301, 7.5.2.13", survives::<1>)
        .stores(),
    Check::new("STO-21", "What is saved by 1010h:2 survives reset node", "CiA 301, 7.5.2.13", survives::<2>)
        .stores(),
    Check::new("STO-22", "What is not saved does not survive reset node", "CiA 301, 7.5.2.13", lost).resets(),
    Check::new("STO-23", "1010h:3 does not save communication parameters", "CiA 301, 7.5.2.13", not_by_three)
        .stores(),
    Check::new("STO-24", "SYNC settings survive 1010h and reset node", "CiA 301, 7.5.2.13", sync_settings)
        .stores(),
    Check::new("STO-25", "1019h survives 1010h and reset node", "CiA 301, 7.5.2.13", sync_counter).stores(),
    Check::new("STO-26", "PDO settings survive 1010h and reset node", "CiA 301, 7.5.2.13", pdo_settings)
        .stores(),
    Check::new("STO-27", "1020h keeps date and time over 1010h and reset node", "CiA 301, 7.5.2.23", date)
        .stores(),
    Check::new("STO-28", "1280h survives 1010h and reset node", "CiA 301, 7.5.2.33", client).stores(),
    Check::new(
        "STO-29",
        "What is saved survives reset communication",
        "CiA 301, 7.3.2.2.1",
        survives_communication,
    )
    .stores(),
    Check::new(
        "STO-30",
        "An application parameter survives 1010h:1 and reset node",
        "CiA 301, 7.5.2.13",
        application,
    )
    .stores(),
];

/// Saves a value by a sub-index of 1010h and restarts. Returns whether the value has survived. The former value is
/// saved again.
fn keeps(
    s: &mut Subject<'_>,
    (index, sub): (u16, u8),
    bytes: &[u8],
    group: u8,
    restart: Command,
) -> Outcome<bool> {
    s.need(0x1010, group)?;
    s.reset(Command::ResetNode)?;
    let kept = s.written.len();
    if (index, sub) == (0x1019, 0) {
        s.unlock_counter()?;
    }
    let is_kept = saved_and_restarted(s, (index, sub), bytes, group, restart);
    s.restoring(|s| {
        s.put_back_since(kept)?;
        s.try_write(0x1010, group, b"save")?
            .map_err(|refusal| fail("the former value is saved again", refusal))
    })?;
    is_kept
}

fn saved_and_restarted(
    s: &mut Subject<'_>,
    (index, sub): (u16, u8),
    bytes: &[u8],
    group: u8,
    restart: Command,
) -> Outcome<bool> {
    s.write(index, sub, bytes)?;
    s.try_write(0x1010, group, b"save")?.map_err(|refusal| fail(format!("1010h:{group} saves"), refusal))?;
    s.reset(restart)?;
    Ok(s.read(index, sub)? == bytes)
}

fn is_kept(s: &mut Subject<'_>, at: (u16, u8), bytes: &[u8]) -> Outcome {
    s.need(at.0, at.1)?;
    let kept = keeps(s, at, bytes, 1, Command::ResetNode)?;
    ensure(kept, format!("{bytes:02X?} in {:04X}h:{} after the restart", at.0, at.1), "another value")
}

fn survives<const GROUP: u8>(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let kept = keeps(s, (0x1017, 0), &4711_u16.to_le_bytes(), GROUP, Command::ResetNode)?;
    ensure(kept, "4711 in 1017h after the restart", "another value")
}

fn survives_communication(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let kept = keeps(s, (0x1017, 0), &4712_u16.to_le_bytes(), 1, Command::ResetCommunication)?;
    ensure(kept, "4712 in 1017h after the restart", "another value")
}

fn lost(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.reset(Command::ResetNode)?;
    let saved = s.number(0x1017, 0)?;
    s.set(0x1017, 0, saved ^ 0x1000)?;
    s.reset(Command::ResetNode)?;
    s.holds(0x1017, 0, saved)
}

fn not_by_three(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let kept = keeps(s, (0x1017, 0), &4713_u16.to_le_bytes(), 3, Command::ResetNode)?;
    ensure(!kept, "the saved value of 1017h", "the value that was not saved")
}

fn sync_settings(s: &mut Subject<'_>) -> Outcome {
    is_kept(s, (0x1006, 0), &250_000_u32.to_le_bytes())
}

fn sync_counter(s: &mut Subject<'_>) -> Outcome {
    is_kept(s, (0x1019, 0), &[20])
}

fn pdo_settings(s: &mut Subject<'_>) -> Outcome {
    let index = *s.pdos(TPDO)?.first().ok_or_else(|| skip("the device has no TPDO"))?;
    s.need(index, 5)?;
    is_kept(s, (index, 5), &777_u16.to_le_bytes())
}

fn date(s: &mut Subject<'_>) -> Outcome {
    is_kept(s, (0x1020, 1), &1234_u32.to_le_bytes())
}

fn client(s: &mut Subject<'_>) -> Outcome {
    is_kept(s, (0x1280, 1), &(OFF | 0x680).to_le_bytes())
}

/// Checks the first parameter of the application that accepts a value with another lowest bit.
fn application(s: &mut Subject<'_>) -> Outcome {
    let entries = s.entries(|entry| {
        let is_own = entry.index >= 0x2000 && crate::configuration::is_parameter(entry);
        is_own && entry.default.is_some() && matches!(entry.data_type.class(), eds::Class::Real(32))
    })?;
    for entry in entries {
        let Ok(mut bytes) = s.try_read(entry.index, entry.sub)? else { continue };
        bytes[0] ^= 1;
        if s.change(entry.index, entry.sub, &bytes)?.is_ok() {
            return is_kept(s, (entry.index, entry.sub), &bytes);
        }
    }
    Err(skip("the data sheet has no application parameter that takes another value"))
}
