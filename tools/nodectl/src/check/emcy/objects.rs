//! Checks of 1001h, 1014h and 1015h.

use super::super::prelude::*;
use super::provoke::{LIFE, codes, lose_heartbeat, lose_heartbeat_only, unused_node_id};

pub(super) const CHECKS: &[Check] = &[
    Check::new("EMC-01", "1014h is 80h and the node-ID", "CiA 301, 7.5.2.17", cob_id),
    Check::new("EMC-02", "1001h has one byte", "CiA 301, 7.5.2.2", register_size),
    Check::new("EMC-03", "1001h is 0 without an error", "CiA 301, 7.5.2.2", register_clear),
    Check::new("EMC-04", "1014h refuses another CAN-ID while EMCY is on", "CiA 301, 7.5.2.17", locked),
    Check::new("EMC-05", "1014h refuses restricted CAN-IDs", "CiA 301, 7.3.5", restricted),
    Check::new("EMC-06", "Bit 31 of 1014h switches EMCY off", "CiA 301, 7.5.2.17", off),
    Check::new("EMC-07", "EMCY is sent with the CAN-ID of 1014h", "CiA 301, 7.5.2.17", moved),
    Check::new("EMC-08", "1015h takes a time", "CiA 301, 7.5.2.18", inhibit),
    Check::new("EMC-09", "Bit 0 of 1001h is set with any other bit", "CiA 301, 7.5.2.2", generic),
];

fn cob_id(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1014, 0)?;
    let expected = 0x80 + u32::from(s.id());
    s.with_default_of((0x1014, 0), expected, |s| s.holds(0x1014, 0, expected))
}

fn register_size(s: &mut Subject<'_>) -> Outcome {
    let bytes = s.read(0x1001, 0)?;
    ensure(bytes.len() == 1, "one byte", format!("{bytes:02X?}"))
}

/// Whether the device has an error: then there are entries in its list.
fn register_clear(s: &mut Subject<'_>) -> Outcome {
    let register = s.number(0x1001, 0)?;
    if register != 0 && s.optional(0x1003, 0)?.is_some_and(|count| count > 0) {
        return Err(skip(format!(
            "the device has an error: 1001h is {register:02X}h, and 1003h has entries"
        )));
    }
    ensure(register == 0, "0", format!("{register:02X}h"))
}

fn locked(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1014, 0)?;
    s.plain_emcy()?;
    let other = 0x80 + u32::from(unused_node_id(s));
    s.refuses(
        0x1014,
        0,
        other,
        &[abort::VALUE, abort::STATE, abort::ACCESS, abort::PARAMETER, abort::READ_ONLY],
    )
}

fn restricted(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1014, 0)?;
    let before = s.number(0x1014, 0)?;
    s.set_if_supported(0x1014, 0, before | OFF)?;
    for id in [0x000, 0x07F, 0x101, 0x580 + u32::from(s.id()), 0x600 + u32::from(s.id()), 0x6E0, 0x701] {
        s.refuses(0x1014, 0, id, &[abort::VALUE, abort::TOO_HIGH, abort::TOO_LOW, abort::PARAMETER])?;
    }
    Ok(())
}

fn off(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1014, 0)?;
    let before = s.number(0x1014, 0)?;
    s.set_if_supported(0x1014, 0, before | OFF)?;
    let node = unused_node_id(s);
    let mark = lose_heartbeat_only(s, node)?;
    let codes = codes(s, mark);
    ensure(codes.is_empty(), "no EMCY", format!("{codes:04X?}"))
}

fn moved(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1014, 0)?;
    let before = s.number(0x1014, 0)?;
    s.set_if_supported(0x1014, 0, before | OFF)?;
    s.set_if_supported(0x1014, 0, 0x6D0 | OFF)?;
    s.set_if_supported(0x1014, 0, 0x6D0)?;
    let node = unused_node_id(s);
    let mark = lose_heartbeat_only(s, node)?;
    let moved = s.heard(mark, 0x6D0);
    let is_told = moved.iter().any(|heard| heard.frame.data().starts_with(&LIFE.to_le_bytes()));
    ensure(is_told, "EMCY 8130h with CAN-ID 6D0h", format!("{} frames with it", moved.len()))
}

fn inhibit(s: &mut Subject<'_>) -> Outcome {
    s.need(0x1015, 0)?;
    s.set(0x1015, 0, 5000)?;
    s.holds(0x1015, 0, 5000)
}

fn generic(s: &mut Subject<'_>) -> Outcome {
    let node = unused_node_id(s);
    lose_heartbeat(s, node)?;
    let register = s.number(0x1001, 0)?;
    ensure(register & 1 != 0, "bit 0 is set while there is an error", format!("{register:02X}h"))
}
