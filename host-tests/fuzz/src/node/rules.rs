//! The rules that hold after every step.

use canopen::dictionary::{Access, Object, Rule};
use canopen::{CanId, Frame};
use node::State;

use super::board::{Board, upload};
use super::step::Step;

const LSS_RESPONSE: u16 = 0x7E4;
const DOWNLOADED: u8 = 0x60;

/// The state that a step can change and that the rules depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    state: State,
    node_id: Option<u16>,
}

impl Seen {
    pub(super) fn of(board: &Board) -> Seen {
        Seen { state: board.state(), node_id: board.node_id() }
    }
}

/// Checks the behaviour of the board in a step.
pub(super) fn check(step: &Step, before: Seen, board: &mut Board) {
    let sent = board.sent();
    let after = Seen::of(board);
    transition(step, before, after, board);
    for frame in &sent {
        is_allowed(frame, [before, after], board);
    }
    if let Step::Write { row, value } = step {
        let (row, value) = (board.row(*row), Step::download(*row, *value));
        let is_accepted = sent.iter().any(|frame| is_answer(frame, after, DOWNLOADED, row));
        if is_accepted && !board.has_started {
            reads_back(row, value, after, board);
        }
    }
}

/// Only the master or a start leads to Operational or out of Stopped (CiA 301, 7.3.2.2); an error leads in the opposite
/// direction.
fn transition(step: &Step, before: Seen, after: Seen, board: &Board) {
    let is_told = matches!(step, Step::Nmt { .. } | Step::Frame { .. } | Step::Process { .. });
    let needs_a_cause =
        before.state != after.state && (after.state == State::Operational || before.state == State::Stopped);
    assert!(!needs_a_cause || is_told || board.has_started, "{before:?} to {after:?} by {step:?}");
    assert!(after.state != State::Initialising || after.node_id.is_none(), "it waits for LSS only");
}

/// The allowed frames of each state (CiA 301, table 38). A step may change the state, so the state before or after must
/// allow the frame.
fn is_allowed(frame: &Frame, seen: [Seen; 2], board: &mut Board) {
    let is_own = |base: u16| seen.iter().any(|seen| seen.node_id.is_some_and(|id| base + id == frame.id()));
    let has = |allowed: fn(State) -> bool| seen.iter().any(|seen| allowed(seen.state));
    assert!(!frame.is_remote(), "a node asks for nothing: {frame:?}");
    if frame.id() == LSS_RESPONSE {
        assert_eq!(frame.len(), 8, "{frame:?}");
    } else if is_own(0x700) {
        let codes = seen.map(|seen| seen.state.code());
        let [code] = frame.data() else { panic!("error control is one byte: {frame:?}") };
        assert!(codes.contains(code) || (*code == 0 && board.has_started), "{frame:?} in {seen:?}");
    } else if is_own(0x580) {
        assert!(has(State::has_services), "SDO in {seen:?}: {frame:?}");
    } else if has(State::has_pdos) {
        assert!(CanId::new(frame.id()).is_some(), "{frame:?}");
    } else {
        assert!(has(State::has_services) && is_emergency(frame, board), "{frame:?} in {seen:?}");
    }
}

/// Whether the frame has the COB-ID of EMCY from 1014h.
fn is_emergency(frame: &Frame, board: &mut Board) -> bool {
    let cob_id = Object::new(0x1014, 0, "", canopen::dictionary::Type::Unsigned32, Access::ReadWrite);
    let after = Seen::of(board);
    // The COB-ID cannot be read if the step has ended the services.
    !after.state.has_services()
        || read(&cob_id, after, board).is_some_and(|[a, b, ..]| u16::from_le_bytes([a, b]) == frame.id())
}

/// The value of an accepted write reads back.
fn reads_back(row: &Object, value: [u8; 4], after: Seen, board: &mut Board) {
    if row.access == Access::WriteOnly || acts(row.rule()) {
        return;
    }
    let size = usize::from(row.kind.size()).min(4);
    let found = read(row, after, board);
    let found = found.as_ref().map(|found| &found[..size]);
    assert_eq!(found, Some(&value[..size]), "{:04X}h:{} {:?}", row.index, row.sub, row.rule());
}

/// Whether a write is a command: the object then reads back another value.
fn acts(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::Store
            | Rule::Restore
            | Rule::StoreCalibration
            | Rule::ProgramControl
            | Rule::Setting
            | Rule::ErrorCount
    )
}

fn read(row: &Object, seen: Seen, board: &mut Board) -> Option<[u8; 4]> {
    board.sdo(upload(row));
    board.settle();
    let sent = board.sent();
    let answer = sent.iter().find(|frame| is_answer(frame, seen, 0x43, row))?;
    answer.data()[4..].try_into().ok()
}

/// Whether the frame is an answer to a request for this row; the length of an upload does not matter.
fn is_answer(frame: &Frame, seen: Seen, command: u8, row: &Object) -> bool {
    let [low, high] = row.index.to_le_bytes();
    let is_ours = seen.node_id.is_some_and(|id| 0x580 + id == frame.id());
    let [first, rest @ ..] = frame.data() else { return false };
    is_ours && first & !0x0C == command & !0x0C && rest.starts_with(&[low, high, row.sub])
}
