//! LSS: selection, configuration, identification and fastscan (CiA 305).

use crate::bench::{Bench, ID};
use canopen::lss::{BitRate, Bound, Configuration, Part, Request, Response};
use canopen::nmt::State;
use canopen::{Action, Duration, Frame, Job, NodeId};

const IDENTITY: [(Part, u32); 4] =
    [(Part::Vendor, 0x1A), (Part::Product, 0x2B), (Part::Revision, 0x0001_0002), (Part::Serial, 0x8000_0005)];

fn send(bench: &mut Bench, request: Request) -> Option<Response> {
    bench.take();
    bench.receive(Frame::new(0x7E5, &request.encode()).unwrap());
    let responses: Vec<_> = bench.sent().into_iter().filter(|(id, _)| *id == 0x7E4).collect();
    assert!(responses.len() <= 1);
    responses.first().map(|(_, data)| Response::parse(data[..].try_into().unwrap()).unwrap())
}

fn select(bench: &mut Bench) {
    for (part, value) in &IDENTITY[..3] {
        assert_eq!(send(bench, Request::Select(*part, *value)), None);
    }
    assert_eq!(send(bench, Request::Select(Part::Serial, IDENTITY[3].1)), Some(Response::Selected));
}

fn configuration(bench: &mut Bench, on: bool) {
    assert_eq!(send(bench, Request::SwitchGlobal { configuration: on }), None);
}

#[test]
fn the_right_identity_in_the_right_order_selects() {
    let mut bench = Bench::booted();
    select(&mut bench);
    assert_eq!(send(&mut bench, Request::InquireNodeId), Some(Response::NodeIdIs(ID)));
    for (part, value) in IDENTITY {
        assert_eq!(send(&mut bench, Request::Inquire(part)), Some(Response::Identity(part, value)));
    }
    configuration(&mut bench, false);
    assert_eq!(send(&mut bench, Request::InquireNodeId), None);
}

#[test]
fn a_wrong_part_or_a_wrong_order_does_not_select() {
    for wrong in 0..4 {
        let mut bench = Bench::booted();
        for (number, (part, value)) in IDENTITY.into_iter().enumerate() {
            let value = if number == wrong { value ^ 1 } else { value };
            assert_eq!(send(&mut bench, Request::Select(part, value)), None);
        }
        assert_eq!(send(&mut bench, Request::InquireNodeId), None);
    }
    let mut bench = Bench::booted();
    for number in [0, 2, 1, 3] {
        let (part, value) = IDENTITY[number];
        assert_eq!(send(&mut bench, Request::Select(part, value)), None);
    }
}

#[test]
fn a_waiting_slave_takes_no_configuration() {
    let mut bench = Bench::booted();
    let requests = [
        Request::NodeId(9),
        Request::BitTiming { table: 0, index: 2 },
        Request::Activate { delay: 1 },
        Request::Store,
        Request::Inquire(Part::Vendor),
    ];
    for request in requests {
        assert_eq!(send(&mut bench, request), None);
        assert_eq!(bench.take_action(), Some(Action::Identifiers).filter(|_| request == requests[0]));
    }
}

#[test]
fn a_new_node_id_counts_from_the_next_reset_communication() {
    let mut bench = Bench::booted();
    configuration(&mut bench, true);
    for refused in [0, 128, 254] {
        assert_eq!(send(&mut bench, Request::NodeId(refused)), Some(Response::NodeId(1)));
    }
    assert_eq!(send(&mut bench, Request::NodeId(9)), Some(Response::NodeId(0)));
    configuration(&mut bench, false);
    assert_eq!(bench.device.node_id(), NodeId::new(ID));
    bench.nmt(0x82);
    bench.start();
    assert_eq!(bench.sent(), [(0x709, vec![0])]);
    assert_eq!(bench.device.node_id(), NodeId::new(9));
    assert!(bench.device.service_ids().any(|id| id.get() == 0x609));
}

#[test]
fn a_node_id_can_be_taken_away() {
    let mut bench = Bench::operational();
    configuration(&mut bench, true);
    assert_eq!(send(&mut bench, Request::NodeId(255)), Some(Response::NodeId(0)));
    bench.nmt(0x82);
    bench.start();
    bench.run(Duration::from_millis(3000));
    assert_eq!(bench.sent(), []);
    assert_eq!((bench.device.state(), bench.device.node_id()), (State::Initialising, None));
    assert_eq!(send(&mut bench, Request::IdentifyUnconfigured), Some(Response::Unconfigured));
}

#[test]
fn an_unconfigured_device_answers_lss_alone_and_boots_with_a_node_id() {
    let mut bench = Bench::unconfigured();
    bench.receive(Frame::new(0, &[1, 0]).unwrap());
    bench.receive(Frame::new(0x600, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]).unwrap());
    bench.run(Duration::from_millis(3000));
    assert_eq!((bench.sent(), bench.device.state()), (vec![], State::Initialising));

    assert_eq!(bench.take_action(), Some(Action::Identifiers));
    select(&mut bench);
    assert_eq!(send(&mut bench, Request::InquireNodeId), Some(Response::NodeIdIs(255)));
    assert_eq!(send(&mut bench, Request::NodeId(0x7F)), Some(Response::NodeId(0)));
    assert_eq!(bench.take_action(), None);
    configuration(&mut bench, false);
    assert_eq!(bench.take_action(), Some(Action::ResetCommunication));
    bench.start();
    assert_eq!(bench.sent(), [(0x77F, vec![0])]);
    assert_eq!(bench.device.state(), State::PreOperational);
    assert_eq!(crate::bench::DICTIONARY.field(0x1014, 0).u32(bench.device.image()), 0xFF);
}

#[test]
fn bit_rates_are_those_of_table_0() {
    let mut bench = Bench::booted();
    configuration(&mut bench, true);
    for index in 0..=255 {
        let code = u8::from(index == 5 || index > 9);
        let response = send(&mut bench, Request::BitTiming { table: 0, index });
        assert_eq!(response, Some(Response::BitTiming(code)));
    }
    let response = send(&mut bench, Request::BitTiming { table: 1, index: 0 });
    assert_eq!(response, Some(Response::BitTiming(1)));
}

#[test]
fn nothing_is_sent_from_the_activation_until_two_delays_later() {
    let mut bench = Bench::operational();
    bench.take_action();
    configuration(&mut bench, true);
    send(&mut bench, Request::BitTiming { table: 0, index: 2 });
    bench.run(Duration::from_millis(500));
    bench.take();
    assert_eq!(send(&mut bench, Request::Activate { delay: 700 }), None);
    bench.run(Duration::from_millis(699));
    assert_eq!((bench.sent(), bench.take_action()), (vec![], None));
    bench.run(Duration::from_millis(1));
    bench.poll();
    let rate = BitRate::from_kbit(500).unwrap();
    assert_eq!(bench.take_action(), Some(Action::BitRate(rate)));
    bench.run(Duration::from_millis(698));
    assert_eq!((bench.sent(), bench.take_action()), (vec![], None));
    bench.run(Duration::from_millis(5));
    assert!(!bench.sent().is_empty(), "what was held back is sent");
    assert_eq!(bench.device.state(), State::Operational);
}

#[test]
fn a_store_is_answered_after_its_end() {
    for (result, code) in [(Ok(()), 0), (Err(canopen::sdo::Abort::General), 2)] {
        let mut bench = Bench::booted();
        bench.take_action();
        configuration(&mut bench, true);
        send(&mut bench, Request::NodeId(9));
        send(&mut bench, Request::BitTiming { table: 0, index: 9 });
        assert_eq!(send(&mut bench, Request::Store), None);
        let configuration = Configuration { node_id: NodeId::new(9), bit_rate: BitRate::AUTO };
        assert_eq!(bench.take_action(), Some(Action::Store(Job::Configure(configuration))));
        assert_eq!(bench.take_action(), None);
        bench.finish(result);
        assert_eq!(bench.sent(), [(0x7E4, Response::Stored(code).encode().to_vec())]);
    }
}

#[test]
fn a_store_of_a_new_node_id_keeps_the_configured_bit_rate() {
    let bit_rate = BitRate::from_kbit(125).unwrap();
    let mut bench = Bench::booted_at(bit_rate);
    bench.take_action();
    configuration(&mut bench, true);
    send(&mut bench, Request::NodeId(9));
    send(&mut bench, Request::Store);
    let configuration = Configuration { node_id: NodeId::new(9), bit_rate };
    assert_eq!(bench.take_action(), Some(Action::Store(Job::Configure(configuration))));
}

#[test]
fn two_stores_at_once_are_one_too_many() {
    let mut bench = Bench::booted();
    assert_eq!(bench.ask_raw([0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']), None);
    configuration(&mut bench, true);
    assert_eq!(send(&mut bench, Request::Store), Some(Response::Stored(2)));
}

#[test]
fn a_slave_is_identified_by_a_range() {
    let (low, high) = (0x8000_0005, 0x8000_0005);
    let cases = [
        ([0x1A, 0x2B, 0x0001_0002, 0x0001_0002, low, high], true),
        ([0x1A, 0x2B, 0, u32::MAX, 0, u32::MAX], true),
        ([0x1B, 0x2B, 0, u32::MAX, 0, u32::MAX], false),
        ([0x1A, 0x2C, 0, u32::MAX, 0, u32::MAX], false),
        ([0x1A, 0x2B, 0x0001_0003, u32::MAX, 0, u32::MAX], false),
        ([0x1A, 0x2B, 0, 0x0001_0001, 0, u32::MAX], false),
        ([0x1A, 0x2B, 0, u32::MAX, low + 1, u32::MAX], false),
        ([0x1A, 0x2B, 0, u32::MAX, 0, high - 1], false),
    ];
    let mut bench = Bench::booted();
    for (values, is_in_range) in cases {
        let mut answers = Bound::ALL.into_iter().zip(values).map(|(bound, value)| {
            let request = Request::Identify(bound, value);
            send(&mut bench, request)
        });
        assert!(answers.by_ref().take(5).all(|answer| answer.is_none()));
        assert_eq!(answers.next().unwrap(), is_in_range.then_some(Response::Identified));
    }
}

#[test]
fn a_configured_slave_is_neither_unconfigured_nor_scanned() {
    let mut bench = Bench::booted();
    assert_eq!(send(&mut bench, Request::IdentifyUnconfigured), None);
    let confirm = Request::Fastscan { value: 0, bit: Request::CONFIRM, part: 0, next: 0 };
    assert_eq!(send(&mut bench, confirm), None);
}

/// Runs the master's side of fastscan against one slave.
fn scan(bench: &mut Bench) -> [u32; 4] {
    let confirm = Request::Fastscan { value: 0, bit: Request::CONFIRM, part: 0, next: 0 };
    assert_eq!(send(bench, confirm), Some(Response::Identified));
    let mut identity = [0; 4];
    for part in 0..4 {
        let mut value = 0;
        for bit in (0..32).rev() {
            let request = Request::Fastscan { value, bit, part, next: part };
            if send(bench, request).is_none() {
                value |= 1 << bit;
            }
        }
        let request = Request::Fastscan { value, bit: 0, part, next: (part + 1) % 4 };
        assert_eq!(send(bench, request), Some(Response::Identified));
        identity[usize::from(part)] = value;
    }
    identity
}

#[test]
fn fastscan_finds_the_identity_and_selects() {
    let mut bench = Bench::unconfigured();
    assert_eq!(scan(&mut bench), IDENTITY.map(|(_, value)| value));
    assert_eq!(send(&mut bench, Request::NodeId(3)), Some(Response::NodeId(0)));
    let confirm = Request::Fastscan { value: 0, bit: Request::CONFIRM, part: 0, next: 0 };
    assert_eq!(send(&mut bench, confirm), None, "one that is found takes part no more");
    configuration(&mut bench, false);
    bench.start();
    assert_eq!(bench.device.node_id(), NodeId::new(3));
}

#[test]
fn a_full_queue_delays_the_response() {
    let mut bench = Bench::booted();
    configuration(&mut bench, true);
    bench.out.room = 0;
    assert_eq!(send(&mut bench, Request::InquireNodeId), None);
    bench.out.room = 10;
    bench.run(Duration::from_millis(1));
    assert_eq!(bench.sent(), [(0x7E4, Response::NodeIdIs(ID).encode().to_vec())]);
}

#[test]
fn lss_works_in_every_state_and_short_frames_are_none() {
    let mut bench = Bench::booted();
    for command in [1, 2, 0x80] {
        bench.nmt(command);
        select(&mut bench);
        configuration(&mut bench, false);
    }
    bench.receive(Frame::new(0x7E5, &[4, 1]).unwrap());
    assert_eq!(send(&mut bench, Request::InquireNodeId), None);
}

#[test]
fn a_bit_rate_changes_at_once_without_a_delay() {
    let mut bench = Bench::booted();
    for request in [[4, 1, 0, 0, 0, 0, 0, 0], [0x13, 0, 3, 0, 0, 0, 0, 0], [0x15, 0, 0, 0, 0, 0, 0, 0]] {
        bench.receive(Frame::new(0x7E5, &request).unwrap());
    }
    let rate = std::iter::from_fn(|| bench.take_action()).find(|action| matches!(action, Action::BitRate(_)));
    assert_eq!(rate, Some(Action::BitRate(BitRate::from_index(3).unwrap())));
    bench.take();
    assert!(bench.read(0x1000, 0).is_ok());
}
#[test]
fn a_reserved_mode_changes_no_state() {
    let mut bench = Bench::booted();
    configuration(&mut bench, true);
    bench.receive(Frame::new(0x7E5, &[4, 2, 0, 0, 0, 0, 0, 0]).unwrap());
    assert_eq!(send(&mut bench, Request::InquireNodeId), Some(Response::NodeIdIs(ID)), "still configured");
}

#[test]
fn a_detected_bit_rate_is_stored_with_a_node_id() {
    let bit_rate = BitRate::from_kbit(50).unwrap();
    let mut bench = Bench::booted();
    bench.take_action();
    bench.device.set_bit_rate(bit_rate);
    configuration(&mut bench, true);
    send(&mut bench, Request::NodeId(7));
    send(&mut bench, Request::Store);
    let configuration = Configuration { node_id: NodeId::new(7), bit_rate };
    assert_eq!(bench.take_action(), Some(Action::Store(Job::Configure(configuration))));
}

#[test]
fn a_configured_device_does_not_boot_when_the_master_is_done() {
    let mut bench = Bench::booted();
    while bench.take_action().is_some() {}
    for id in [None, Some(9)] {
        configuration(&mut bench, true);
        if let Some(id) = id {
            assert_eq!(send(&mut bench, Request::NodeId(id)), Some(Response::NodeId(0)));
        }
        configuration(&mut bench, false);
        assert_eq!((bench.take_action(), bench.device.state()), (None, State::PreOperational), "{id:?}");
    }
}

#[test]
fn a_new_node_id_is_not_used_before_the_master_is_done() {
    let mut bench = Bench::unconfigured();
    while bench.take_action().is_some() {}
    configuration(&mut bench, true);
    assert_eq!(send(&mut bench, Request::NodeId(9)), Some(Response::NodeId(0)));
    configuration(&mut bench, true);
    assert_eq!(bench.take_action(), None);
    assert_eq!(send(&mut bench, Request::InquireNodeId), Some(Response::NodeIdIs(255)));
}

#[test]
fn a_device_is_unconfigured_without_any_node_id_now_and_after_a_reset() {
    for (mut bench, id) in [(Bench::booted(), 255), (Bench::unconfigured(), 9)] {
        configuration(&mut bench, true);
        assert_eq!(send(&mut bench, Request::NodeId(id)), Some(Response::NodeId(0)));
        assert_eq!(send(&mut bench, Request::IdentifyUnconfigured), None, "node-ID {id}");
    }
}

#[test]
fn a_fastscan_with_a_part_out_of_range_has_no_answer() {
    let mut bench = Bench::unconfigured();
    let confirm = |part, next| Request::Fastscan { value: 0, bit: Request::CONFIRM, part, next };
    for (part, next) in [(4, 0), (0, 4), (4, 4)] {
        assert_eq!(send(&mut bench, confirm(part, next)), None, "part {part}, next {next}");
    }
    assert_eq!(send(&mut bench, confirm(3, 3)), Some(Response::Identified));
}

/// The epoch of the clock inside the device moves meanwhile.
#[test]
fn the_longest_delay_ends_in_time() {
    let mut bench = Bench::booted();
    bench.take_action();
    configuration(&mut bench, true);
    send(&mut bench, Request::BitTiming { table: 0, index: 2 });
    send(&mut bench, Request::Activate { delay: u16::MAX });
    bench.run(Duration::from_millis(65_534));
    assert_eq!(bench.take_action(), None);
    bench.run(Duration::from_millis(1));
    assert_eq!(bench.take_action(), BitRate::from_kbit(500).map(Action::BitRate));
}
