//! Checks that 1011h restores the defaults with the next restart.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("STO-40", "1011h:1 brings the defaults back with the restart", "CiA 301, 7.5.2.14", restores)
        .stores(),
    Check::new("STO-41", "1011h:1 changes nothing before the restart", "CiA 301, 7.5.2.14", waits).stores(),
    Check::new("STO-42", "1011h:2 brings communication parameters back", "CiA 301, 7.5.2.14", communication)
        .stores(),
    Check::new("STO-43", "Without 1011h what is saved stays over two restarts", "CiA 301, 7.5.2.13", stays)
        .stores(),
];

/// Saves 1017h with another value than its default. Returns the default.
fn spoil(s: &mut Subject<'_>) -> Outcome<u32> {
    s.need_writable(0x1017, 0)?;
    let default = s.number(0x1017, 0)?;
    s.set(0x1017, 0, default ^ 0x0800)?;
    s.try_write(0x1010, 1, b"save")?.map_err(|refusal| fail("1010h:1 saves", refusal))?;
    Ok(default)
}

fn back(s: &mut Subject<'_>, group: u8) -> Outcome {
    s.need(0x1011, group)?;
    s.with_defaults(|s| {
        let default = spoil(s)?;
        s.try_write(0x1011, group, b"load")?
            .map_err(|refusal| fail(format!("1011h:{group} restores"), refusal))?;
        s.reset(Command::ResetNode)?;
        s.holds(0x1017, 0, default)
    })
}

fn restores(s: &mut Subject<'_>) -> Outcome {
    back(s, 1)
}

fn communication(s: &mut Subject<'_>) -> Outcome {
    back(s, 2)
}

fn waits(s: &mut Subject<'_>) -> Outcome {
    s.with_defaults(|s| {
        let default = spoil(s)?;
        s.try_write(0x1011, 1, b"load")?.map_err(|refusal| fail("1011h:1 restores", refusal))?;
        s.holds(0x1017, 0, default ^ 0x0800)?;
        s.reset(Command::ResetNode)
    })
}

fn stays(s: &mut Subject<'_>) -> Outcome {
    s.with_defaults(|s| {
        let default = spoil(s)?;
        s.reset(Command::ResetNode)?;
        s.reset(Command::ResetNode)?;
        s.holds(0x1017, 0, default ^ 0x0800)
    })
}
