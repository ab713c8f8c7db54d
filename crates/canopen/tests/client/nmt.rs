//! The NMT master waits for the message that shows the effect of its command.

use canopen::client::nmt::Change;
use canopen::client::{Service, Step, Taken};
use canopen::nmt::{Command, State};
use canopen::{Duration, Frame, Instant, NodeId};

const SENT: Instant = Instant(1000);
const END: Instant = Instant(51_000);

/// A change whose command is sent.
fn sent(command: Command) -> Change {
    let mut change = Change::new(command, NodeId::new(5).unwrap(), Duration::from_millis(50));
    let Step::Send(frame) = change.next(SENT) else { panic!("no command") };
    assert_eq!((frame.id(), frame.data()[1]), (0, 5));
    change
}

fn heartbeat(node: u16, state: u8) -> Frame {
    Frame::new(0x700 + node, &[state]).unwrap()
}

#[test]
fn each_command_has_the_state_of_its_effect() {
    for (command, state) in [
        (Command::Start, State::Operational),
        (Command::Stop, State::Stopped),
        (Command::EnterPreOperational, State::PreOperational),
        (Command::ResetNode, State::Initialising),
        (Command::ResetCommunication, State::Initialising),
    ] {
        for other in [State::Operational, State::Stopped, State::PreOperational, State::Initialising] {
            let mut change = sent(command);
            let taken = change.on_frame(&heartbeat(5, other.code()), SENT);
            assert_eq!(taken == Taken::Used, other == state, "{command:?}, {other:?}");
            let step = if other == state { Step::Done(Some(state)) } else { Step::Wait(END) };
            assert_eq!(change.next(SENT), step, "{command:?}, {other:?}");
        }
    }
}

#[test]
fn messages_of_other_nodes_and_before_the_command_do_not_count() {
    let node = NodeId::new(5).unwrap();
    let mut early = Change::new(Command::Start, node, Duration::from_millis(50));
    assert_eq!(early.on_frame(&heartbeat(5, 5), Instant(0)), Taken::Ignored);
    let mut change = sent(Command::Start);
    assert_eq!(change.on_frame(&heartbeat(6, 5), SENT), Taken::Ignored);
    assert_eq!(change.on_frame(&Frame::new(0x185, &[5]).unwrap(), SENT), Taken::Ignored);
    assert_eq!(change.next(END), Step::Done(None), "the time is over");
}
