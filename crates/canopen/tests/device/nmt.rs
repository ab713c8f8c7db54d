//! NMT: commands, the services of each state, boot-up, start-up and error behaviour.

use crate::bench::{Bench, ID, SENSOR_BREAK, UNEXPECTED_RESET};
use canopen::nmt::State;
use canopen::{Action, Duration, ErrorClass, Frame};

const START: u8 = 1;
const STOP: u8 = 2;
const PRE_OPERATIONAL: u8 = 0x80;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;

#[test]
fn boot_up_is_one_zero_byte_and_ends_in_pre_operational() {
    let mut bench = Bench::unstarted();
    bench.start();
    assert_eq!(bench.sent(), [(0x705, vec![0])]);
    assert_eq!(bench.device.state(), State::PreOperational);
}

#[test]
fn a_full_queue_delays_boot_up_but_does_not_lose_it() {
    let mut bench = Bench::unstarted();
    bench.out.room = 0;
    bench.start();
    assert_eq!(bench.sent(), []);
    bench.out.room = 10;
    bench.run(Duration::from_millis(2));
    assert_eq!(bench.sent(), [(0x705, vec![0])]);
}

#[test]
fn before_the_start_the_node_is_silent_and_deaf() {
    let mut bench = Bench::unstarted();
    bench.nmt(START);
    bench.nmt(RESET_NODE);
    bench.run(Duration::from_millis(5000));
    assert_eq!(bench.sent(), []);
    assert_eq!((bench.device.state(), bench.take_action()), (State::Initialising, None));
}

#[test]
fn commands_change_the_state() {
    let mut bench = Bench::booted();
    for (command, state) in
        [(START, State::Operational), (STOP, State::Stopped), (PRE_OPERATIONAL, State::PreOperational)]
    {
        bench.nmt(command);
        assert_eq!(bench.device.state(), state);
        bench.receive(Frame::new(0, &[command, 0]).unwrap());
        assert_eq!(bench.device.state(), state);
    }
}

#[test]
fn commands_for_others_and_malformed_ones_do_nothing() {
    let mut bench = Bench::booted();
    for data in [&[START, ID + 1][..], &[START], &[START, ID, 0], &[], &[0, ID], &[0x83, ID], &[0xFF, 0]] {
        bench.receive(Frame::new(0, data).unwrap());
        assert_eq!(bench.device.state(), State::PreOperational);
    }
    bench.receive(Frame::remote(0, 2).unwrap());
    assert_eq!(bench.device.state(), State::PreOperational);
}

#[test]
fn stopped_has_heartbeat_and_nothing_else() {
    let mut bench = Bench::operational();
    bench.nmt(STOP);
    bench.take();
    bench.raise(SENSOR_BREAK);
    assert_eq!(bench.ask_raw([0x40, 0, 0x10, 0, 0, 0, 0, 0]), None);
    bench.sync();
    bench.run(Duration::from_millis(3000));
    let sent = bench.sent();
    assert_eq!(sent, vec![(0x705, vec![State::Stopped.code()]); 3]);
}

#[test]
fn what_waits_for_a_state_with_emcy_is_sent_then() {
    let mut bench = Bench::booted();
    bench.nmt(STOP);
    bench.raise(SENSOR_BREAK);
    bench.poll();
    assert_eq!(bench.sent(), []);
    bench.nmt(PRE_OPERATIONAL);
    assert_eq!(bench.sent(), [(0x085, vec![0x06, 0x50, 1, 0, 0, 0, 0, 0])]);
}

#[test]
fn a_reset_is_told_once_and_the_node_waits_for_its_start() {
    for (command, action) in
        [(RESET_NODE, Action::ResetNode), (RESET_COMMUNICATION, Action::ResetCommunication)]
    {
        let mut bench = Bench::operational();
        while bench.take_action().is_some() {}
        bench.nmt(command);
        assert_eq!(bench.take_action(), Some(action));
        assert_eq!(bench.take_action(), None);
        bench.run(Duration::from_millis(5000));
        assert_eq!(bench.sent(), []);
        bench.start();
        assert_eq!(bench.sent(), [(0x705, vec![0])]);
        assert_eq!(bench.device.state(), State::PreOperational);
    }
}

#[test]
fn reset_communication_restores_communication_only() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &[10, 0]).unwrap();
    bench.write(0x6100, 0, &[3, 0]).unwrap();
    bench.nmt(RESET_COMMUNICATION);
    bench.start();
    assert_eq!(bench.read(0x1017, 0), Ok(vec![0xE8, 3]));
    assert_eq!(bench.read(0x6100, 0), Ok(vec![3, 0]));
    bench.nmt(RESET_NODE);
    bench.start();
    assert_eq!(bench.read(0x6100, 0), Ok(vec![0, 0]));
}

#[test]
fn start_up_takes_pre_operational_and_self_start_only() {
    let mut bench = Bench::booted();
    for value in [1, 2, 4, 0x0C, 0x108, 0x8000_0000] {
        assert_eq!(bench.write32(0x1F80, 0, value), Err(0x0609_0030));
    }
    assert_eq!((bench.write32(0x1F80, 0, 8), bench.write32(0x1F80, 0, 0)), (Ok(()), Ok(())));
}

#[test]
fn a_node_that_starts_by_itself_boots_up_first_and_waits_for_values() {
    let mut bench = Bench::unstarted();
    bench.device.application_mut().start_up = 8;
    bench.start();
    assert_eq!(bench.device.state(), State::PreOperational);
    assert_eq!(bench.sent(), [(0x705, vec![0])]);
    bench.set_value(1, &[1, 2, 3, 4]);
    assert_eq!(bench.device.state(), State::Operational);
    assert_eq!(bench.sent(), [(0x185, vec![1, 2, 3, 4])]);
}

#[test]
fn a_master_that_was_faster_has_the_last_word() {
    for (command, state) in [(STOP, State::Stopped), (PRE_OPERATIONAL, State::PreOperational)] {
        let mut bench = Bench::unstarted();
        bench.device.application_mut().start_up = 8;
        bench.start();
        bench.nmt(command);
        bench.set_value(1, &[1, 2, 3, 4]);
        assert_eq!(bench.device.state(), state);
    }
}

#[test]
fn a_node_with_an_error_does_not_start_by_itself() {
    let mut bench = Bench::unstarted();
    bench.device.application_mut().start_up = 8;
    bench.raise(UNEXPECTED_RESET);
    bench.start();
    bench.set_value(1, &[1, 2, 3, 4]);
    assert_eq!(bench.device.state(), State::PreOperational);
    assert_eq!(bench.sent(), [(0x705, vec![0]), (0x085, vec![0x01, 0x61, 1, 0, 0, 0, 0, 0])]);
}

#[test]
fn error_behaviour_0_leaves_operational_only() {
    let mut bench = Bench::operational();
    bench.error(ErrorClass::COMMUNICATION);
    assert_eq!(bench.device.state(), State::PreOperational);
    bench.nmt(STOP);
    bench.error(ErrorClass::COMMUNICATION);
    assert_eq!(bench.device.state(), State::Stopped);
}

#[test]
fn error_behaviour_2_stops_and_others_change_nothing() {
    for (value, state) in [(1, State::Operational), (3, State::Operational), (2, State::Stopped)] {
        let mut bench = Bench::operational();
        bench.write(0x1029, 1, &[value]).unwrap();
        bench.error(ErrorClass::COMMUNICATION);
        assert_eq!(bench.device.state(), state);
    }
}

#[test]
fn error_behaviour_has_the_limits_of_its_sub_indexes() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1029, 1, &[254]), Ok(()));
    assert_eq!(bench.write(0x1029, 1, &[255]), Err(0x0609_0031));
    assert_eq!(bench.write(0x1029, 2, &[3]), Err(0x0609_0031));
}
