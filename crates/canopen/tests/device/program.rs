//! Program control (1F51h; CiA 302-3) of a running application: stop and reset start the bootloader.

use canopen::dictionary::{Dictionary, Object};
use canopen::{Action, Application, Device, Frame, Instant, NodeId, objects};

use crate::types::Sent;

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::identity(0, 1, 1),
    objects::program_control(),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

struct Nothing;

impl Application for Nothing {}

/// The action that follows a write to 1F51h:1, and the answers.
fn control(value: u8) -> (Option<Action>, Vec<[u8; 8]>) {
    let mut device: canopen::device!(Nothing, ROWS) = Device::new(&DICTIONARY, NodeId::new(5), Nothing);
    let mut next = device.start(Instant(0), &mut Sent::default());
    while next.action.is_some() {
        next = device.poll(Instant(0), &mut Sent::default());
    }
    let mut sent = Sent::default();
    let request = Frame::new(0x605, &[0x2F, 0x51, 0x1F, 1, value, 0, 0, 0]).unwrap();
    let next = device.on_frame(&request, Instant(1), &mut sent);
    let answers = sent.0.iter().filter(|frame| frame.id() == 0x585);
    (next.action, answers.map(|frame| frame.data().try_into().unwrap()).collect())
}

#[test]
fn stop_and_reset_start_the_bootloader_which_answers_the_next_request() {
    for value in [0, 2] {
        assert_eq!(control(value), (Some(Action::Bootloader), vec![]), "{value}");
    }
}

#[test]
fn start_of_a_running_program_is_answered_and_changes_nothing() {
    assert_eq!(control(1), (None, vec![[0x60, 0x51, 0x1F, 1, 0, 0, 0, 0]]));
}

#[test]
fn an_unknown_command_is_aborted() {
    for value in [4, 0x80, 0xFF] {
        let (action, answers) = control(value);
        assert_eq!((action, answers[0][0]), (None, 0x80), "{value}");
    }
}
