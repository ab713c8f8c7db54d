//! Checks of the SYNC producer, which is optional.

use super::super::prelude::*;
use crate::Logged;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "SYN-20",
        "A SYNC producer with 1006h = 100 ms sends ten in a second",
        "CiA 301, 7.5.2.6",
        ten,
    ),
    Check::new("SYN-21", "1006h = 0 silences the SYNC producer", "CiA 301, 7.5.2.6", silent),
    Check::new("SYN-22", "1019h = 0: a SYNC has no data", "CiA 301, 7.2.5.3.1", no_data),
    Check::new("SYN-23", "1019h = 5: the counter runs from 1 to 5", "CiA 301, 7.2.5.3.1", counter),
    Check::new("SYN-24", "The SYNC producer is silent in Stopped", "CiA 301, table 38", stopped),
    Check::new("SYN-25", "Without bit 30 of 1005h no SYNC is sent", "CiA 301, 7.5.2.5", off),
];

/// Makes the device a SYNC producer with a period of 100 ms. Skipped where the device cannot be one.
fn produce(s: &mut Subject<'_>, overflow: u32) -> Outcome {
    s.need_solitude()?;
    s.need(0x1006, 0)?;
    s.set(0x1006, 0, 0)?;
    if s.try_read(0x1019, 0)?.is_ok() {
        s.set_if_supported(0x1019, 0, overflow)?;
    } else if overflow != 0 {
        s.need(0x1019, 0)?;
    }
    s.set(0x1006, 0, 100_000)?;
    s.set_if_supported(0x1005, 0, 0x4000_0080)
}

fn syncs(s: &mut Subject<'_>, ms: u64) -> Outcome<Vec<Logged>> {
    let mark = s.mark();
    s.pass(ms)?;
    Ok(s.heard(mark, 0x080))
}

fn ten(s: &mut Subject<'_>) -> Outcome {
    produce(s, 0)?;
    let count = syncs(s, 1000)?.len();
    ensure((9..=11).contains(&count), "9 to 11 SYNC in 1 s", format!("{count}"))
}

fn silent(s: &mut Subject<'_>) -> Outcome {
    produce(s, 0)?;
    s.set(0x1006, 0, 0)?;
    let count = syncs(s, 500)?.len();
    ensure(count == 0, "no SYNC", format!("{count}"))
}

fn no_data(s: &mut Subject<'_>) -> Outcome {
    produce(s, 0)?;
    let syncs = syncs(s, 500)?;
    ensure(!syncs.is_empty(), "SYNC", "none in 500 ms")?;
    ensure(
        syncs.iter().all(|sync| sync.frame.is_empty()),
        "no data",
        format!("{:02X?}", syncs[0].frame.data()),
    )
}

fn counter(s: &mut Subject<'_>) -> Outcome {
    produce(s, 5)?;
    let counters: Vec<u8> =
        syncs(s, 1500)?.iter().filter_map(|sync| sync.frame.data().first().copied()).collect();
    let runs = counters.windows(2).all(|pair| pair[1] == pair[0] % 5 + 1) && counters.contains(&5);
    ensure(runs, "1, 2, 3, 4, 5, 1 and so on", format!("{counters:?}"))
}

fn stopped(s: &mut Subject<'_>) -> Outcome {
    produce(s, 0)?;
    s.enter(State::Stopped)?;
    let count = syncs(s, 500)?.len();
    ensure(count == 0, "no SYNC", format!("{count}"))
}

fn off(s: &mut Subject<'_>) -> Outcome {
    produce(s, 0)?;
    s.set(0x1005, 0, 0x80)?;
    let count = syncs(s, 500)?.len();
    ensure(count == 0, "no SYNC", format!("{count}"))
}
