//! Checks of the transmission of TPDOs in the state Operational.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("PDO-20", "A remote frame is answered with the TPDO", "CiA 301, 7.2.2.5.2", remote),
    Check::new(
        "PDO-21",
        "Type 255 with event timer: sent each time it elapses",
        "CiA 301, 7.5.2.37",
        timer::<255>,
    ),
    Check::new(
        "PDO-22",
        "Type 254 with event timer: sent each time it elapses",
        "CiA 301, 7.5.2.37",
        timer::<254>,
    ),
    Check::new("PDO-23", "Type 1: sent with each SYNC", "CiA 301, table 72", cyclic::<1>),
    Check::new("PDO-24", "Type 3: sent with each third SYNC", "CiA 301, table 72", cyclic::<3>),
    Check::new("PDO-25", "Type 240 is taken", "CiA 301, table 72", slowest),
    Check::new("PDO-26", "Type 0: never without SYNC", "CiA 301, table 72", acyclic_without),
    Check::new("PDO-27", "Type 0: at most once with a SYNC", "CiA 301, table 72", acyclic_once),
    Check::new("PDO-28", "Type 1: never without SYNC", "CiA 301, table 72", cyclic_without),
    Check::new("PDO-29", "The SYNC start value delays the first TPDO", "CiA 301, 7.5.2.37", start_value),
    Check::new("PDO-30", "The inhibit time is kept", "CiA 301, 7.5.2.37", inhibit),
    Check::new("PDO-31", "Type 254 is not sent by a SYNC", "CiA 301, table 72", not_by_sync),
    Check::new("PDO-32", "A synchronous TPDO comes soon after the SYNC", "CiA 301, 7.2.2.3", soon)
        .recommended(),
];

fn remote(s: &mut Subject<'_>) -> Outcome {
    let mut pdo = s.tpdo(254, 0)?;
    pdo.cob_id &= !0x4000_0000;
    if s.try_write(pdo.index, 1, &pdo.cob_id.to_le_bytes())?.is_err() {
        return Err(skip("the device has no remote frames, as CiA recommends (bit 30 of the COB-ID)"));
    }
    s.enter(State::Operational)?;
    s.pass(50)?;
    let mark = s.mark();
    s.remote(pdo.id(), 8)?;
    s.pass(100)?;
    let count = s.heard(mark, pdo.id()).len();
    ensure(count == 1, "one answer", format!("{count}"))
}

fn timer<const TYPE: u32>(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(TYPE, 100)?;
    let count = s.count(pdo, State::Operational, 1000)?;
    // With type 255, a changed value triggers the TPDO, too.
    let enough = count >= 9 && (TYPE == 255 || count <= 12);
    ensure(enough, "a frame each 100 ms", format!("{count} in 1 s"))
}

/// The number of frames of a TPDO after each of `syncs` SYNC messages.
fn with_syncs(s: &mut Subject<'_>, pdo: super::super::subject::Pdo, syncs: usize) -> Outcome<Vec<usize>> {
    let mut counts = Vec::new();
    for _ in 0..syncs {
        let mark = s.mark();
        s.sync()?;
        counts.push(s.heard(mark, pdo.id()).len());
    }
    Ok(counts)
}

fn cyclic<const N: usize>(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(u32::try_from(N).unwrap_or(1), 0)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let counts = with_syncs(s, pdo, 4 * N)?;
    let each = counts.iter().all(|count| *count <= 1) && counts.iter().sum::<usize>() == 4;
    ensure(each, format!("4 frames with {} SYNC", 4 * N), format!("{counts:?}"))
}

fn slowest(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(1, 0)?;
    s.set(pdo.index, 2, 240)?;
    s.holds(pdo.index, 2, 240)
}

fn without(s: &mut Subject<'_>, transmission: u32) -> Outcome {
    let pdo = s.tpdo(transmission, 0)?;
    let count = s.count(pdo, State::Operational, 500)?;
    ensure(count == 0, "no frame without SYNC", format!("{count}"))
}

fn acyclic_without(s: &mut Subject<'_>) -> Outcome {
    without(s, 0)
}

fn cyclic_without(s: &mut Subject<'_>) -> Outcome {
    without(s, 1)
}

fn acyclic_once(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(0, 0)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let counts = with_syncs(s, pdo, 5)?;
    ensure(counts.iter().all(|count| *count <= 1), "at most one frame with a SYNC", format!("{counts:?}"))
}

fn start_value(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(1, 0)?;
    s.need(pdo.index, 6)?;
    s.need(0x1019, 0)?;
    s.unlock_counter()?;
    s.set_if_supported(0x1019, 0, 10)?;
    s.set_if_supported(pdo.index, 6, 4)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mut counts = Vec::new();
    for counter in 1..=6 {
        let mark = s.mark();
        s.send(0x080, &[counter])?;
        s.pass(20)?;
        counts.push(s.heard(mark, pdo.id()).len());
    }
    ensure(
        counts == [0, 0, 0, 1, 1, 1],
        "the first frame with SYNC 4",
        format!("{counts:?} with SYNC 1 to 6"),
    )
}

fn inhibit(s: &mut Subject<'_>) -> Outcome {
    let pdo = s.tpdo(254, 20)?;
    s.need(pdo.index, 3)?;
    s.set(pdo.index, 3, 1000)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    s.pass(1000)?;
    let heard = s.heard(mark, pdo.id());
    let least = heard.windows(2).map(|pair| pair[1].at.0.saturating_sub(pair[0].at.0)).min();
    let least = least.ok_or_else(|| fail("a frame each 100 ms", format!("{} in 1 s", heard.len())))?;
    ensure(least >= 98_000, "100 ms between frames", format!("{least} us"))
}

fn not_by_sync(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(254, 0)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    s.pass(100)?;
    let counts = with_syncs(s, pdo, 5)?;
    ensure(counts.iter().sum::<usize>() == 0, "no frame", format!("{counts:?}"))
}

fn soon(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    let pdo = s.tpdo(1, 0)?;
    s.switch_on(pdo)?;
    s.enter(State::Operational)?;
    let mark = s.mark();
    s.send(0x080, &[])?;
    s.pass(10)?;
    let count = s.heard(mark, pdo.id()).len();
    ensure(count == 1, "the TPDO within 10 ms", format!("{count} frames"))
}
