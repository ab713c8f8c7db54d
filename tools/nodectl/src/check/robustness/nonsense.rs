//! Checks with frames that have no meaning.

use super::super::prelude::*;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "ROB-20",
        "An SDO request of fewer than eight bytes does no harm",
        "CiA 301, 7.2.4.3",
        short_sdo,
    ),
    Check::new(
        "ROB-21",
        "A remote frame with the CAN-ID of SDO does no harm",
        "CiA 301, 7.2.4.3",
        remote_sdo,
    ),
    Check::new("ROB-22", "Every first byte of an SDO request does no harm", "CiA 301, 7.2.4.3", all_commands),
    Check::new("ROB-23", "Nonsense changes no parameter", "CiA 301, 7.2.4", parameters_stay),
    Check::new("ROB-24", "LSS nonsense does no harm", "CiA 305, 3.8", lss),
    Check::new("ROB-25", "NMT frames of any length do no harm", "CiA 301, 7.2.8.2.1", nmt),
    Check::new("ROB-26", "SYNC of any length does no harm", "CiA 301, 7.2.5.3", sync),
    Check::new(
        "ROB-27",
        "A download that was left alone does not block the server",
        "CiA 301, 7.2.4",
        left_alone,
    ),
    Check::new(
        "ROB-28",
        "Frames of any length with the CAN-IDs of RPDOs do no harm",
        "CiA 301, 7.2.2",
        rpdos,
    ),
];

/// Pseudo-random bytes, the same in each run.
fn noise(seed: u32) -> [u8; 8] {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    std::array::from_fn(|_| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state.to_le_bytes()[0]
    })
}

fn short_sdo(s: &mut Subject<'_>) -> Outcome {
    let id = 0x600 + s.id();
    for len in 0..8 {
        s.send(id, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0][..len])?;
    }
    s.pass(100)?;
    s.serves("short requests")
}

fn remote_sdo(s: &mut Subject<'_>) -> Outcome {
    let (mark, id, answers) = (s.mark(), 0x600 + s.id(), 0x580 + s.id());
    s.remote(id, 8)?;
    s.remote(answers, 8)?;
    s.pass(200)?;
    let count = s.heard(mark, answers).len();
    ensure(count == 0, "no answer to remote frames", format!("{count}"))?;
    s.serves("remote frames")
}

/// Sends a request with every first byte, for an object that does not exist.
fn all_commands(s: &mut Subject<'_>) -> Outcome {
    let id = 0x600 + s.id();
    for command in 0..=255_u8 {
        s.send(id, &[command, 0xFF, 0x0F, 0, 1, 2, 3, 4])?;
        s.pass(2)?;
    }
    s.give_up(0x0FFF, 0)?;
    s.pass(50)?;
    s.serves("requests with every first byte")
}

/// Parameters that nonsense must not change.
fn parameters(s: &mut Subject<'_>) -> Outcome<Vec<Option<u32>>> {
    [(0x1005, 0), (0x1014, 0), (0x1016, 1), (0x1017, 0), (0x1400, 1), (0x1800, 1), (0x1A00, 1)]
        .into_iter()
        .map(|(index, sub)| s.optional(index, sub))
        .collect()
}

fn parameters_stay(s: &mut Subject<'_>) -> Outcome {
    let before = parameters(s)?;
    let id = 0x600 + s.id();
    for seed in 0..200 {
        // The first byte is random. The index is one of a data type, which no device has as an object.
        let mut request = noise(seed);
        request[2] = 0x00;
        s.send(id, &request)?;
        s.pass(2)?;
    }
    s.give_up(0x0FFF, 0)?;
    s.pass(50)?;
    let after = parameters(s)?;
    ensure(before == after, format!("{before:X?}"), format!("{after:X?}"))
}

fn lss(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    for command in (0..=255_u8).filter(|command| !matches!(command, 0x04 | 0x11..=0x17 | 0x40..=0x5F)) {
        s.send(0x7E5, &[command, 1, 2, 3, 4, 5, 6, 7])?;
    }
    for len in 0..8 {
        s.send(0x7E5, &[0x5E; 8][..len])?;
    }
    s.pass(100)?;
    s.serves("LSS nonsense")
}

fn nmt(s: &mut Subject<'_>) -> Outcome {
    s.beat(50)?;
    let own = s.node().get();
    for len in [0, 3, 4, 5, 6, 7, 8] {
        s.send(0x000, &[0x77, own, 1, 1, 1, 1, 1, 1][..len])?;
    }
    s.pass(50)?;
    s.tells(State::PreOperational)?;
    s.serves("NMT frames of any length")
}

fn sync(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.enter(State::Operational)?;
    for len in 0..=8 {
        s.send(0x080, &[0xFF; 8][..len])?;
        s.pass(5)?;
    }
    s.serves("SYNC of any length")
}

fn left_alone(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    s.answer([0x21, 0x17, 0x10, 0, 2, 0, 0, 0])?;
    // Wait longer than the time-out of a server. A server without a time-out must accept a new transfer.
    s.pass(3000)?;
    s.is_served()?;
    s.serves("a download that was left alone")
}

fn rpdos(s: &mut Subject<'_>) -> Outcome {
    s.need_solitude()?;
    s.beat(50)?;
    let own = s.id();
    for base in [0x200, 0x300, 0x400, 0x500] {
        for len in 0..=8 {
            s.send(base + own, &[0; 8][..len])?;
        }
    }
    // In Pre-operational no RPDO may have an effect.
    s.tells(State::PreOperational)?;
    s.serves("RPDOs of any length")
}
