//! Checks of the heartbeat consumer (1016h), and of the behaviour after a missing heartbeat (1029h).

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new("ERR-20", "1016h: two entries for one node are refused", "CiA 301, 7.5.2.19", twice),
    Check::new("ERR-21", "Content while heartbeats arrive in time", "CiA 301, 7.2.8.3.2.2", content),
    Check::new("ERR-22", "A lost heartbeat is told by EMCY 8130h", "CiA 301, table 26", lost),
    Check::new(
        "ERR-23",
        "A lost heartbeat leads from Operational to Pre-operational",
        "CiA 301, 7.5.2.33",
        reaction::<0>,
    ),
    Check::new("ERR-24", "1029h:1 = 1: a lost heartbeat changes nothing", "CiA 301, 7.5.2.33", reaction::<1>),
    Check::new(
        "ERR-25",
        "1029h:1 = 2: a lost heartbeat leads to Stopped",
        "CiA 301, 7.5.2.33",
        reaction::<2>,
    ),
    Check::new("ERR-26", "A monitored node that is back is watched again", "CiA 301, 7.2.8.3.2.2", again),
    Check::new(
        "ERR-27",
        "Nothing is missing before the first heartbeat",
        "CiA 301, 7.5.2.19",
        before_the_first,
    ),
    Check::new("ERR-28", "1016h with time 0 watches nobody", "CiA 301, 7.5.2.19", time_zero),
    Check::new("ERR-29", "1016h with node-ID 0 watches nobody", "CiA 301, 7.5.2.19", node_zero),
    Check::new("ERR-30", "1016h has entries of four bytes", "CiA 301, 7.5.2.19", entries),
];

/// A node-ID that no node has, as far as was heard.
fn other(s: &Subject<'_>) -> u16 {
    if s.id() == 0x70 { 0x71 } else { 0x70 }
}

/// Lets the device watch a node with a heartbeat time of 200 ms.
fn watch(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.need(0x1016, 1)?;
    s.plain_emcy()?;
    for sub in 1..=u8::try_from(s.number(0x1016, 0)?).unwrap_or(1) {
        s.set(0x1016, sub, 0)?;
    }
    let node = u32::from(other(s));
    s.set(0x1016, 1, node << 16 | 200)
}

fn beat(s: &mut Subject<'_>, times: usize) -> Outcome {
    let node = other(s);
    for _ in 0..times {
        s.send(0x700 + node, &[0x05])?;
        s.pass(100)?;
    }
    Ok(())
}

/// The emergency error codes since a place in the log.
fn codes(s: &Subject<'_>, mark: super::super::subject::Mark) -> Vec<u16> {
    let heard = s.heard(mark, 0x80 + s.id());
    heard.iter().filter_map(|heard| Some(u16::from_le_bytes(*heard.frame.data().first_chunk()?))).collect()
}

fn twice(s: &mut Subject<'_>) -> Outcome {
    watch(s)?;
    s.need(0x1016, 2)?;
    let node = u32::from(other(s));
    s.refuses(0x1016, 2, node << 16 | 300, &[abort::PARAMETER])
}

fn content(s: &mut Subject<'_>) -> Outcome {
    watch(s)?;
    let mark = s.mark();
    beat(s, 10)?;
    let codes = codes(s, mark);
    ensure(!codes.contains(&0x8130), "no EMCY 8130h", format!("{codes:04X?}"))
}

fn lost(s: &mut Subject<'_>) -> Outcome {
    watch(s)?;
    let mark = s.mark();
    beat(s, 2)?;
    s.pass(500)?;
    let codes = codes(s, mark);
    ensure(codes.contains(&0x8130), "EMCY 8130h", format!("{codes:04X?}"))
}

fn reaction<const BEHAVIOUR: u32>(s: &mut Subject<'_>) -> Outcome {
    if BEHAVIOUR != 0 || s.try_read(0x1029, 1)?.is_ok() {
        s.need(0x1029, 1)?;
        s.set_if_supported(0x1029, 1, BEHAVIOUR)?;
    }
    watch(s)?;
    s.beat(50)?;
    s.enter(State::Operational)?;
    beat(s, 2)?;
    s.pass(500)?;
    s.tells(match BEHAVIOUR {
        0 => State::PreOperational,
        1 => State::Operational,
        _ => State::Stopped,
    })
}

fn again(s: &mut Subject<'_>) -> Outcome {
    watch(s)?;
    beat(s, 2)?;
    s.pass(500)?;
    let mark = s.mark();
    let node = other(s);
    s.send(0x700 + node, &[0x00])?;
    beat(s, 2)?;
    s.pass(500)?;
    let codes = codes(s, mark);
    ensure(codes.contains(&0x8130), "EMCY 8130h a second time", format!("{codes:04X?}"))
}

fn quiet(s: &mut Subject<'_>, value: u32, beats: usize) -> Outcome {
    watch(s)?;
    s.set(0x1016, 1, value)?;
    let mark = s.mark();
    beat(s, beats)?;
    s.pass(600)?;
    let codes = codes(s, mark);
    ensure(!codes.contains(&0x8130), "no EMCY 8130h", format!("{codes:04X?}"))
}

fn before_the_first(s: &mut Subject<'_>) -> Outcome {
    let value = u32::from(other(s)) << 16 | 200;
    quiet(s, value, 0)
}

fn time_zero(s: &mut Subject<'_>) -> Outcome {
    let value = u32::from(other(s)) << 16;
    quiet(s, value, 2)
}

fn node_zero(s: &mut Subject<'_>) -> Outcome {
    quiet(s, 200, 2)
}

fn entries(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1016, 0)?;
    for sub in 1..=u8::try_from(s.number(0x1016, 0)?).unwrap_or(0) {
        let bytes = s.read(0x1016, sub)?;
        ensure(bytes.len() == 4, format!("four bytes in 1016h:{sub}"), format!("{bytes:02X?}"))?;
    }
    Ok(())
}
