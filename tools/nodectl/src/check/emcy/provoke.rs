//! Provokes an error from the bus: a missing heartbeat.

use super::super::prelude::*;
use super::super::subject::Mark;
use crate::Logged;

/// The emergency error code of a missing heartbeat.
pub(super) const LIFE: u16 = 0x8130;

/// Lets the device miss a heartbeat, with the pre-defined COB-ID of EMCY.
pub(super) fn lose_heartbeat(s: &mut Subject<'_>, node: u16) -> Outcome<Mark> {
    s.plain_emcy()?;
    lose_heartbeat_only(s, node)
}

/// Lets the device miss the heartbeat of a node that does not exist. Returns the place in the log from which on the
/// EMCY may come. Skipped where the device watches no heartbeat.
pub(super) fn lose_heartbeat_only(s: &mut Subject<'_>, node: u16) -> Outcome<Mark> {
    s.need_solitude()?;
    if s.try_read(0x1016, 1)?.is_err() {
        return Err(skip("no error can be caused from the bus: the device has no 1016h"));
    }
    watch(s, node)?;
    let mark = s.mark();
    s.send(0x700 + node, &[0x05])?;
    s.pass(400)?;
    Ok(mark)
}

/// Lets the device watch this node, and no other one, whose heartbeat is missing.
pub(super) fn watch(s: &mut Subject<'_>, node: u16) -> Outcome {
    s.set(0x1016, 1, u32::from(node) << 16 | 100)
}

/// Sends the heartbeat again and ends its supervision, so that the error is gone.
pub(super) fn heartbeat_is_back(s: &mut Subject<'_>, node: u16) -> Outcome<Mark> {
    let mark = s.mark();
    s.send(0x700 + node, &[0x05])?;
    s.pass(20)?;
    s.set(0x1016, 1, 0)?;
    s.pass(300)?;
    Ok(mark)
}

/// The EMCY messages since a place in the log.
pub(super) fn messages(s: &Subject<'_>, mark: Mark) -> Vec<Logged> {
    s.heard(mark, 0x80 + s.id())
}

/// The error codes since a place in the log.
pub(super) fn codes(s: &Subject<'_>, mark: Mark) -> Vec<u16> {
    let code = |heard: &Logged| Some(u16::from_le_bytes(*heard.frame.data().first_chunk()?));
    messages(s, mark).iter().filter_map(code).collect()
}

/// A node-ID that no node has.
pub(super) fn unused_node_id(s: &Subject<'_>) -> u16 {
    if s.id() == 0x6F { 0x6E } else { 0x6F }
}
