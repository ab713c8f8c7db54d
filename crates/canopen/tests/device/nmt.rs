//! NMT: commands, the services of each state, boot-up, start-up and error behaviour.

use crate::bench::{Bench, DEVICE_FAULT, DICTIONARY, ID, SENSOR_BREAK, UNEXPECTED_RESET};
use crate::service_device::Loader;
use crate::types::Sent;
use canopen::dictionary::{Access, Dictionary, Group, Groups, Object, Type};
use canopen::lss::{BitRate, Request};
use canopen::nmt::State;
use canopen::{
    Action, Application, BusEvent, Condition, Device, Duration, ErrorClass, Frame, Instant, Job, NodeId,
    objects,
};

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
fn an_emcy_waits_for_a_state_with_emcy() {
    let mut bench = Bench::booted();
    bench.nmt(STOP);
    bench.raise(SENSOR_BREAK);
    bench.poll();
    assert_eq!(bench.sent(), []);
    bench.nmt(PRE_OPERATIONAL);
    assert_eq!(bench.sent(), [(0x085, vec![0x06, 0x50, 1, 0, 0, 0, 0, 0])]);
}

#[test]
fn a_reset_is_reported_once_and_the_node_waits_for_its_start() {
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
fn a_self_starting_node_boots_up_first_and_waits_for_values() {
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
fn an_earlier_command_of_the_master_cancels_the_self_start() {
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
    bench.poll();
    assert_eq!(bench.device.state(), State::PreOperational);
    bench.nmt(STOP);
    bench.error(ErrorClass::COMMUNICATION);
    bench.poll();
    assert_eq!(bench.device.state(), State::Stopped);
}

#[test]
fn error_behaviour_2_stops_and_others_change_nothing() {
    for (value, state) in [(1, State::Operational), (3, State::Operational), (2, State::Stopped)] {
        let mut bench = Bench::operational();
        bench.write(0x1029, 1, &[value]).unwrap();
        bench.error(ErrorClass::COMMUNICATION);
        bench.poll();
        assert_eq!(bench.device.state(), state);
    }
}

/// EMCYs and heartbeats since the last call: code or state.
fn reported(bench: &mut Bench) -> Vec<u16> {
    let report = |(id, data): (u16, Vec<u8>)| match id {
        0x085 => Some(u16::from_le_bytes([data[0], data[1]])),
        0x705 => Some(data[0].into()),
        _ => None,
    };
    bench.sent().into_iter().filter_map(report).collect()
}

/// An operational device that watches node 9 and sends its next heartbeat at the moment at which that of node 9 is
/// missing.
fn watching(behaviour: u8) -> Bench {
    let mut bench = Bench::operational();
    bench.write(0x1029, 1, &[behaviour]).unwrap();
    bench.write(0x1029, 2, &[behaviour]).unwrap();
    bench.write32(0x1016, 1, 0x0009_000A).unwrap();
    bench.write(0x1017, 0, &[10, 0]).unwrap();
    bench.receive(Frame::new(0x709, &[5]).unwrap());
    bench.take();
    bench
}

#[test]
fn the_emcy_of_an_error_is_sent_before_the_state_changes() {
    for (behaviour, state) in [(0, State::PreOperational), (1, State::Operational), (2, State::Stopped)] {
        let mut bench = watching(behaviour);
        bench.run(Duration::from_millis(11));
        assert_eq!(reported(&mut bench), [0x8130, u16::from(state.code())], "1029h:1 = {behaviour}");
        assert_eq!(bench.device.state(), state);

        let mut bench = watching(behaviour);
        bench.run(Duration::from_millis(9));
        bench.take();
        bench.raise(DEVICE_FAULT);
        bench.poll();
        assert_eq!((reported(&mut bench), bench.device.state()), (vec![0x5003], state));
    }
}

#[test]
fn a_stopping_node_is_pre_operational_until_its_emcys_are_sent() {
    let mut bench = watching(2);
    bench.write(0x1017, 0, &[0, 0]).unwrap();
    bench.write(0x1015, 0, &50_u16.to_le_bytes()).unwrap();
    bench.raise(SENSOR_BREAK);
    bench.poll();
    bench.raise(DEVICE_FAULT);
    bench.run(Duration::from_millis(4));
    assert_eq!((reported(&mut bench), bench.device.state()), (vec![0x5006], State::PreOperational));
    bench.run(Duration::from_millis(2));
    assert_eq!((reported(&mut bench), bench.device.state()), (vec![0x5003], State::Stopped));

    for (command, state) in [(PRE_OPERATIONAL, State::PreOperational), (START, State::Operational)] {
        let mut bench = watching(2);
        bench.out.room = 0;
        bench.raise(DEVICE_FAULT);
        bench.poll();
        bench.nmt(command);
        bench.out.room = 100;
        bench.run(Duration::from_millis(5));
        assert_eq!(bench.device.state(), state, "the master's command is the newer one");
    }
}

#[test]
fn bus_off_is_reported_before_the_node_stops() {
    let mut bench = watching(2);
    bench.write32(0x1016, 1, 0).unwrap();
    bench.take();
    bench.bus(BusEvent::BusOff);
    assert_eq!(bench.device.state(), State::PreOperational, "no PDOs");
    bench.bus(BusEvent::Recovered);
    let codes: Vec<_> = reported(&mut bench).into_iter().filter(|code| *code > 0x7F).collect();
    assert_eq!((codes, bench.device.state()), (vec![0x8140], State::Stopped));
}

#[test]
fn an_error_found_at_the_start_is_reported_before_the_node_stops() {
    for (behaviour, state) in [(0, State::PreOperational), (1, State::PreOperational), (2, State::Stopped)] {
        for is_damaged in [true, false] {
            let mut bench = Bench::unstarted();
            bench.device.application_mut().stored[0] = vec![0x29, 0x10, 2, 1, 1, behaviour];
            bench.device.application_mut().is_damaged = is_damaged;
            if !is_damaged {
                bench.raise(DEVICE_FAULT);
            }
            let codes = if is_damaged { vec![0x6302, 0x6303, 0x6300] } else { vec![0x5003] };
            for _ in 0..2 {
                bench.start();
                bench.poll();
                assert_eq!(reported(&mut bench), [&[0][..], &codes].concat(), "1029h:2 = {behaviour}");
                assert_eq!(bench.device.state(), state, "1029h:2 = {behaviour}");
                bench.nmt(RESET_COMMUNICATION);
            }
        }
    }
}

#[test]
fn error_behaviour_has_the_limits_of_its_sub_indexes() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1029, 1, &[254]), Ok(()));
    assert_eq!(bench.write(0x1029, 1, &[255]), Err(0x0609_0031));
    assert_eq!(bench.write(0x1029, 2, &[3]), Err(0x0609_0031));
}

/// The communication parameters are those of the group, wherever the objects are.
#[test]
fn a_reset_of_the_communication_resets_the_parameters_of_the_group_alone() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &[0xF4, 0x01]).unwrap();
    bench.write(0x5F01, 0, &[9]).unwrap();
    bench.write(0x6100, 0, &[4, 0]).unwrap();
    bench.take_parameters();
    bench.nmt(0x82);
    bench.start();
    assert!(bench.take_parameters(), "the application learns of it");
    assert_eq!(bench.read(0x1017, 0), Ok(vec![0xE8, 0x03]));
    assert_eq!(bench.read(0x5F01, 0), Ok(vec![3]));
    assert_eq!(bench.read(0x6100, 0), Ok(vec![4, 0]));
}

/// A pause, as for the erase of a flash page, disturbs no client, no heartbeat, and no PDO.
#[test]
fn a_pause_is_possible_between_requests_outside_of_operational() {
    let mut bench = Bench::booted();
    let can_pause = |bench: &Bench, ms| bench.device.can_pause(Duration::from_millis(ms), bench.now);
    // The last heartbeat was at the start, and the time is 1000 ms.
    assert!(can_pause(&bench, 1500) && !can_pause(&bench, 1501));
    bench.nmt(2);
    assert!(can_pause(&bench, 1500), "in Stopped");
    bench.nmt(1);
    assert!(!can_pause(&bench, 1), "in Operational");
    bench.nmt(0x80);
    assert!(can_pause(&bench, 1500));
    // The name of the device has more than four bytes.
    bench.ask_raw([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]).unwrap();
    assert!(!can_pause(&bench, 1), "within a transfer");
    bench.receive(Frame::new(0x605, &[0x80, 0x08, 0x10, 0, 0, 0, 0, 0]).unwrap());
    assert!(can_pause(&bench, 1500), "after its end");
    bench.write(0x1017, 0, &[0, 0]).unwrap();
    assert!(can_pause(&bench, 3_600_000), "without heartbeats");
}

/// The queue is full at the start, and has room again before the device tries to boot up once more.
#[test]
fn nothing_precedes_the_boot_up_message() {
    type Ask = fn(&mut Bench);
    let asks: [Ask; 4] = [
        |bench| bench.nmt(1),
        |bench| _ = bench.ask_raw([0x40, 0, 0x10, 0, 0, 0, 0, 0]),
        |bench| bench.raise(0),
        |bench| bench.set_value(1, &[1]),
    ];
    for ask in asks {
        let mut bench = Bench::unstarted();
        bench.out.room = 0;
        bench.start();
        assert_eq!(bench.device.state(), State::Initialising);
        bench.out.room = usize::MAX;
        ask(&mut bench);
        assert!(bench.take().is_empty());
        bench.run(Duration::from_millis(5));
        assert_eq!(bench.take().first().map(Frame::id), Some(0x705));
        assert_eq!(bench.device.state(), State::PreOperational);
    }
}

#[test]
fn a_load_keeps_the_scope_of_the_reset() {
    for (command, value) in [(0x82, [1, 2]), (0x81, [0, 0])] {
        let mut bench = Bench::booted();
        bench.write(0x6200, 0, &[1, 2]).unwrap();
        bench.nmt(command);
        bench.device.load();
        bench.start();
        assert_eq!(bench.read(0x6200, 0), Ok(value.to_vec()), "command {command:02X}h");
    }
}

#[test]
fn a_load_keeps_the_waiting_actions() {
    let mut bench = Bench::booted();
    while bench.take_action().is_some() {}
    let reset = Frame::new(0, &[0x81, ID]).unwrap();
    let _ = bench.device.on_process_frame(&reset, bench.now, &mut bench.out);
    bench.device.load();
    assert_eq!(bench.take_action(), Some(Action::ResetNode));
}

#[test]
fn a_load_uses_the_node_id_of_the_next_start() {
    let mut bench = Bench::unstarted();
    bench.device.set_node_id(NodeId::new(9));
    bench.device.load();
    assert_eq!(DICTIONARY.field(0x1014, 0).u32(bench.device.image()), 0x89);
}

/// The reset is handed over first, and the caller starts the device at once.
#[test]
fn a_start_keeps_the_due_change_of_the_bit_rate() {
    let mut bench = Bench::booted();
    while bench.take_action().is_some() {}
    for request in [
        Request::SwitchGlobal { configuration: true },
        Request::BitTiming { table: 0, index: 2 },
        Request::Activate { delay: 10 },
    ] {
        bench.receive(Frame::new(0x7E5, &request.encode()).unwrap());
    }
    bench.now = bench.now + Duration::from_millis(10);
    let reset = Frame::new(0, &[0x82, ID]).unwrap();
    let _ = bench.device.on_process_frame(&reset, bench.now, &mut bench.out);
    let next = bench.device.poll_services(bench.now, &mut bench.out);
    assert_eq!(next.action, Some(Action::ResetCommunication));
    bench.start();
    let actions: Vec<Action> = std::iter::from_fn(|| bench.take_action()).collect();
    assert!(actions.contains(&Action::BitRate(BitRate::from_kbit(500).unwrap())), "{actions:?}");
}

/// The end of a job comes before the next poll.
#[test]
fn an_error_with_stopped_in_1029h_ends_the_transfers() {
    let mut bench = Bench::operational();
    bench.write(0x1029, 1, &[2]).unwrap();
    bench.bus(BusEvent::Recovered);
    bench.take();
    assert_eq!(bench.ask_raw([0x2F, 0, 0x5F, 0, 2, 0, 0, 0]), None, "the response waits for the job");
    let _ = bench.device.error(ErrorClass::COMMUNICATION);
    assert_eq!(bench.device.state(), State::Stopped);
    let _ = bench.device.finish(Ok(()), bench.now, &mut bench.out);
    assert!(bench.take().iter().all(|frame| frame.id() != 0x585));
}

#[test]
fn a_start_without_a_node_id_forgets_the_boot_up_message() {
    let mut bench = Bench::unstarted();
    bench.out.room = 0;
    bench.start();
    bench.device.set_node_id(None);
    bench.start();
    bench.out.room = 10;
    bench.run(Duration::from_millis(5000));
    assert_eq!(bench.sent(), []);
}

/// CiA 301, 7.3.2.2.1: the parameters of the communication profile area are set to their power-on values.
#[test]
fn a_reset_of_the_communication_keeps_the_objects_from_2000h_on() {
    const AREAS: [u16; 3] = [0x1FFF, 0x2000, 0x6000];
    const fn value(index: u16) -> Object {
        Object::new(index, 0, "", Type::Unsigned8, Access::ReadWrite)
    }
    const ROWS: &[Object] = canopen::rows!(
        [objects::device_type(0), objects::error_register()],
        objects::identity(0, 1, 1),
        [value(AREAS[0]), value(AREAS[1]), value(AREAS[2])],
    );
    static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
    let mut sent = Sent::default();
    let mut node: canopen::device!(Loader, ROWS) =
        Device::new(&DICTIONARY, NodeId::new(ID), Loader::default());
    let _ = node.start(Instant(0), &mut sent);
    for (command, expected) in [(RESET_COMMUNICATION, [0, 7, 7]), (RESET_NODE, [0; 3])] {
        for index in AREAS {
            let [low, high] = index.to_le_bytes();
            let write = Frame::new(0x600 + u16::from(ID), &[0x2F, low, high, 0, 7, 0, 0, 0]).unwrap();
            let _ = node.on_frame(&write, Instant(1), &mut sent);
        }
        let _ = node.on_frame(&Frame::new(0, &[command, ID]).unwrap(), Instant(2), &mut sent);
        let _ = node.start(Instant(3), &mut sent);
        let values = AREAS.map(|index| DICTIONARY.field(index, 0).u8(node.image()));
        assert_eq!(values, expected, "{command:X}h");
    }
}

#[test]
fn the_debug_output_of_a_device_has_its_node_id_and_its_state() {
    let text = format!("{:?}", Bench::operational().device);
    assert_eq!(text, "Device { node_id: Some(NodeId(5)), state: Operational, .. }");
}

/// The actions that the services hand over at this instant, one for each call.
fn actions(bench: &mut Bench) -> Vec<Action> {
    let mut actions = vec![];
    loop {
        let next = bench.device.poll_services(bench.now, &mut bench.out);
        actions.extend(next.action);
        if next.services > bench.now {
            return actions;
        }
    }
}

/// The services are due until the caller has every action.
#[test]
fn a_reset_and_a_job_of_an_rpdo_are_both_handed_over() {
    let application = Groups::one(Group::Application);
    let mut bench = Bench::operational();
    bench.write32(0x1600, 1, 0x6201_0008).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.device.application_mut().stores = Some(application);
    actions(&mut bench);
    for frame in [Frame::new(0x205, &[7]), Frame::new(0, &[RESET_COMMUNICATION, ID])] {
        let _ = bench.device.on_process_frame(&frame.unwrap(), bench.now, &mut bench.out);
    }
    let expected = [Action::ResetCommunication, Action::Store(Job::Store(application))];
    assert_eq!(actions(&mut bench), expected);
}

/// A device whose bus changes to 125 kbit/s at this instant.
fn changing_its_bit_rate() -> Bench {
    let mut bench = Bench::booted();
    for request in [
        Request::SwitchGlobal { configuration: true },
        Request::BitTiming { table: 0, index: 4 },
        Request::Activate { delay: 10 },
    ] {
        bench.receive(Frame::new(0x7E5, &request.encode()).unwrap());
    }
    actions(&mut bench);
    bench.now = bench.now + Duration::from_millis(10);
    bench
}

#[test]
fn a_new_bit_rate_is_handed_over_beside_a_reset() {
    let mut bench = changing_its_bit_rate();
    let reset = Frame::new(0, &[RESET_COMMUNICATION, ID]).unwrap();
    let _ = bench.device.on_process_frame(&reset, bench.now, &mut bench.out);
    assert_eq!(
        actions(&mut bench),
        [Action::ResetCommunication, Action::BitRate(BitRate::from_kbit(125).unwrap())]
    );
}

#[test]
fn new_identifiers_are_handed_over_beside_a_new_bit_rate() {
    let mut bench = changing_its_bit_rate();
    let off = Frame::new(0x600 + u16::from(ID), &[0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80]).unwrap();
    let next = bench.device.on_service_frame(&off, bench.now, &mut bench.out);
    assert_eq!(next.action, Some(Action::BitRate(BitRate::from_kbit(125).unwrap())));
    assert!(next.services <= bench.now, "the services are due for the next action");
    assert_eq!(actions(&mut bench), [Action::Identifiers]);
}

/// A caller that starts the device again before it has asked for the action.
#[test]
fn a_start_carries_out_a_reset_that_has_not_been_handed_over() {
    let mut bench = Bench::booted();
    actions(&mut bench);
    let reset = Frame::new(0, &[RESET_COMMUNICATION, ID]).unwrap();
    let _ = bench.device.on_process_frame(&reset, bench.now, &mut bench.out);
    let next = bench.device.start(bench.now, &mut bench.out);
    assert_eq!(next.action, Some(Action::Identifiers));
    assert_eq!(actions(&mut bench), []);
}

/// Counts the calls for errors, by their class.
#[derive(Default)]
struct Errors(Vec<u8>);

impl Application for Errors {
    const CONDITIONS: &'static [Condition] =
        &[Condition::new(0x5000), Condition::new(0x5001).of_class(ErrorClass::DEVICE)];

    fn error(&mut self, ErrorClass(class): ErrorClass, _: &mut [u8]) {
        self.0.push(class);
    }
}

#[test]
fn a_device_without_emcy_reacts_to_an_error_once_and_after_each_reset() {
    const ROWS: &[Object] = canopen::rows!(
        [objects::device_type(0), objects::error_register()],
        objects::error_behaviour(2),
        objects::identity(0, 1, 1),
    );
    static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
    let mut sent = Sent::default();
    let mut node: canopen::device!(Errors, ROWS) =
        Device::new(&DICTIONARY, NodeId::new(ID), Errors::default());
    let _ = node.start(Instant(0), &mut sent);
    let _ = node.on_frame(&Frame::new(0, &[START, ID]).unwrap(), Instant(1), &mut sent);
    for (condition, classes, state) in [(0, &[][..], State::Operational), (1, &[2], State::Stopped)] {
        for now in [2, 3] {
            let _ = node.set_condition(condition, true, Instant(now));
            let _ = node.poll(Instant(now), &mut sent);
        }
        assert_eq!((&node.application().0[..], node.state()), (classes, state), "condition {condition}");
    }
    let _ = node.on_frame(&Frame::new(0, &[RESET_COMMUNICATION, ID]).unwrap(), Instant(4), &mut sent);
    let _ = node.start(Instant(5), &mut sent);
    let _ = node.poll(Instant(6), &mut sent);
    assert_eq!((&node.application().0[..], node.state()), (&[2, 2][..], State::Stopped));
    assert!(sent.0.iter().all(|frame| frame.id() == 0x705));
}
