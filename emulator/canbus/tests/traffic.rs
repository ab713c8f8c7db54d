//! Undisturbed traffic: times, arbitration, acknowledgement, load.

use canbus::{
    Babbler, Bus, Controller, Event, ExtendedId, Frame, HostNode, Id, Order, StandardId, Time, frame_bits,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const BIT: Time = Time(Time::PER_MICRO);

fn run(bus: &mut Bus, nodes: &mut [&mut dyn Controller], until: Time) -> Vec<Event> {
    let mut events = Vec::new();
    bus.step(nodes, until, &mut |event| events.push(event));
    events
}

fn standard(id: u16, data: &[u8]) -> Frame {
    Frame::data(StandardId::new(id).unwrap(), data).unwrap()
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        (0..0x800_u16).prop_map(|raw| Id::from(StandardId::new(raw).unwrap())),
        (0..1_u32 << 29).prop_map(|raw| Id::from(ExtendedId::new(raw).unwrap())),
        // Equal bits need many stuff bits.
        prop_oneof![Just(0), Just(0x1FFF_FFFF)].prop_map(|raw| Id::from(ExtendedId::new(raw).unwrap())),
    ];
    let byte = prop_oneof![Just(0_u8), Just(0xFF), Just(0xF8), any::<u8>()];
    let data = prop::collection::vec(byte, 0..=8);
    (id, data, any::<bool>()).prop_map(|(id, data, remote)| {
        if remote { Frame::remote(id, data.len() as u8) } else { Frame::data(id, &data) }.unwrap()
    })
}

/// An independent encoder: bit by bit, with the shift register of the CAN specification (Bosch 2.0, 3.1.1).
fn bits_by_hand(frame: &Frame) -> u64 {
    fn push(bits: &mut Vec<bool>, value: u32, width: u32) {
        bits.extend((0..width).rev().map(|n| value >> n & 1 == 1));
    }
    let mut bits = vec![false];
    match frame.id() {
        Id::Standard(id) => {
            push(&mut bits, u32::from(id.as_raw()), 11);
            bits.extend([frame.is_remote(), false, false]);
        }
        Id::Extended(id) => {
            push(&mut bits, id.as_raw() >> 18, 11);
            bits.extend([true, true]);
            push(&mut bits, id.as_raw() & 0x3_FFFF, 18);
            bits.extend([frame.is_remote(), false, false]);
        }
    }
    push(&mut bits, u32::from(frame.dlc()), 4);
    frame.bytes().iter().for_each(|byte| push(&mut bits, u32::from(*byte), 8));
    let crc = bits.iter().fold(0_u32, |crc, bit| {
        let next = *bit ^ (crc & 0x4000 != 0);
        (crc << 1 & 0x7FFF) ^ if next { 0x4599 } else { 0 }
    });
    push(&mut bits, crc, 15);
    let (mut stuffed, mut last, mut run) = (0, true, 0);
    for bit in bits {
        run = if bit == last { run + 1 } else { 1 };
        last = bit;
        stuffed += 1;
        if run == 5 {
            stuffed += 1;
            last = !bit;
            run = 1;
        }
    }
    stuffed + 1 + 2 + 7 + 3
}

/// Property tests run the same cases each time.
fn fixed() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(fixed())]

    #[test]
    fn length_agrees_with_a_second_encoder(frame in any_frame()) {
        prop_assert_eq!(frame_bits(&frame), bits_by_hand(&frame));
    }

    #[test]
    fn the_wire_takes_as_long_as_the_frame_and_delivers_it(frame in any_frame()) {
        let (mut a, mut b) = (HostNode::new(BIT), HostNode::new(BIT));
        a.send(frame, Time::ZERO);
        let mut bus = Bus::new();
        run(&mut bus, &mut [&mut a, &mut b], Time::from_millis(1));
        let bits = frame_bits(&frame);
        let received = b.receive().unwrap();
        prop_assert_eq!(received.frame, frame);
        prop_assert_eq!(received.at, BIT * (bits - 4));
        prop_assert_eq!(bus.busy(Time::from_millis(1)), BIT * bits);
        prop_assert_eq!(a.backlog(), 0);
    }

}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..fixed() })]

    #[test]
    fn contenders_go_in_the_order_of_their_identifiers(
        frames in prop::collection::hash_map(any_frame().prop_map(|frame| frame.arbitration()), any_frame(), 2..40)
    ) {
        // One node for each frame, all with different arbitration fields.
        let mut frames: Vec<Frame> = frames.into_values().collect();
        frames.sort_by_key(wire_order);
        frames.dedup_by_key(|frame| wire_order(frame));
        let mut nodes: Vec<HostNode> = frames.iter().map(|_| HostNode::new(BIT)).collect();
        for (node, frame) in nodes.iter_mut().zip(frames.iter().rev()) {
            node.send(*frame, Time::ZERO);
        }
        let mut participants: Vec<&mut dyn Controller> = nodes.iter_mut().map(|n| n as &mut dyn Controller).collect();
        let events = run(&mut Bus::new(), &mut participants, Time::from_millis(100));
        let order: Vec<Frame> = events.iter().filter_map(|event| match event {
            Event::Frame { frame, .. } => Some(*frame),
            Event::Error { .. } => None,
        }).collect();
        prop_assert_eq!(order, frames);
    }
}

/// The arbitration field as a string of bits, so that the expected order does not depend on the bus model.
fn wire_order(frame: &Frame) -> Vec<bool> {
    let bits = |value: u32, width: u32| (0..width).rev().map(move |n| value >> n & 1 == 1);
    match frame.id() {
        Id::Standard(id) => bits(id.as_raw().into(), 11).chain([frame.is_remote(), false]).collect(),
        Id::Extended(id) => bits(id.as_raw() >> 18, 11)
            .chain([true, true])
            .chain(bits(id.as_raw(), 18))
            .chain([frame.is_remote()])
            .collect(),
    }
}

#[test]
fn base_wins_over_extended_and_data_over_remote() {
    let (base, extended) = (StandardId::new(0x123).unwrap(), ExtendedId::new(0x123 << 18).unwrap());
    let frames = [
        Frame::data(base, &[]).unwrap(),
        Frame::remote(base, 0).unwrap(),
        Frame::data(extended, &[]).unwrap(),
        Frame::remote(extended, 0).unwrap(),
    ];
    assert!(frames.is_sorted_by_key(Frame::arbitration));
}

#[test]
fn a_request_in_the_intermission_takes_part_in_the_next_arbitration() {
    let (mut a, mut b) = (HostNode::new(BIT), HostNode::new(BIT));
    let mut bus = Bus::new();
    a.send(standard(0x100, &[]), Time::ZERO);
    a.send(standard(0x200, &[]), Time::ZERO);
    let end = BIT * frame_bits(&standard(0x100, &[]));
    b.send(standard(0x180, &[]), end);
    let events = run(&mut bus, &mut [&mut a, &mut b], Time::from_millis(1));
    assert!(matches!(events[1], Event::Frame { start, transmitter: 1, .. } if start == end));
}

#[test]
fn an_idle_bus_says_when_the_next_frame_begins() {
    let (mut a, mut b) = (HostNode::new(BIT), HostNode::new(BIT));
    let mut bus = Bus::new();
    let at = Time::from_millis(5);
    assert_eq!(bus.step(&mut [&mut a, &mut b], Time::ZERO, &mut |_| {}), Time::NEVER);
    a.send(standard(1, &[]), at);
    assert_eq!(bus.step(&mut [&mut a, &mut b], Time::ZERO, &mut |_| {}), at);
    let received = BIT * (frame_bits(&standard(1, &[])) - 4);
    assert_eq!(bus.step(&mut [&mut a, &mut b], at, &mut |_| {}), at + received);
    assert_eq!(bus.step(&mut [&mut a, &mut b], at + received, &mut |_| {}), at + received + BIT);
}

#[test]
fn a_queue_is_sent_by_priority_or_in_order() {
    for (order, expected) in [(Order::Priority, [0x10, 0x20, 0x30]), (Order::Fifo, [0x20, 0x30, 0x10])] {
        let (mut a, mut b) = (HostNode::new(BIT).with_order(order), HostNode::new(BIT));
        [0x20, 0x30, 0x10].into_iter().for_each(|id| a.send(standard(id, &[]), Time::ZERO));
        run(&mut Bus::new(), &mut [&mut a, &mut b], Time::from_millis(1));
        let ids: Vec<_> = std::iter::from_fn(|| b.receive()).map(|r| r.frame.arbitration() >> 21).collect();
        assert_eq!(ids, expected);
    }
}

#[test]
fn a_silent_node_hears_but_does_not_acknowledge() {
    let (mut a, mut listener, mut b) = (HostNode::new(BIT), HostNode::new(BIT).silent(), HostNode::new(BIT));
    let mut bus = Bus::new();
    a.send(standard(0x100, &[]), Time::ZERO);
    run(&mut bus, &mut [&mut a, &mut listener], Time::from_micros(50));
    assert_eq!((a.backlog(), listener.receive()), (1, None));
    run(&mut bus, &mut [&mut a, &mut listener, &mut b], Time::from_millis(1));
    assert_eq!(a.backlog(), 0);
    assert!(listener.receive().is_some() && b.receive().is_some());
}

#[test]
fn a_babbler_fills_the_bus_to_its_set_load() {
    for (load, range) in [(1.0, 0.9999..=1.0), (0.5, 0.49..=0.51), (0.05, 0.045..=0.055)] {
        let (mut babbler, mut a) = (Babbler::new(BIT, load, Babbler::foreign(), 1), HostNode::new(BIT));
        let mut bus = Bus::new();
        let second = Time::from_millis(1000);
        run(&mut bus, &mut [&mut babbler, &mut a], second);
        let measured = bus.busy(second).as_secs_f64();
        assert!(range.contains(&measured), "{load}: {measured}");
        assert_eq!(babbler.sent(), std::iter::from_fn(|| a.receive()).count() as u64);
    }
}

#[test]
fn a_hundred_and_fifty_participants() {
    let mut nodes: Vec<HostNode> = (0..150).map(|_| HostNode::new(BIT)).collect();
    for (n, node) in nodes.iter_mut().enumerate() {
        (0..3).for_each(|k| node.send(standard(k * 0x100 + n as u16, &[k as u8]), Time::ZERO));
    }
    let mut participants: Vec<&mut dyn Controller> =
        nodes.iter_mut().map(|n| n as &mut dyn Controller).collect();
    let events = run(&mut Bus::new(), &mut participants, Time::from_millis(1000));
    assert_eq!(events.len(), 450);
    assert!(nodes.iter_mut().all(|node| std::iter::from_fn(|| node.receive()).count() == 447));
}

#[test]
fn the_size_of_the_steps_does_not_matter() {
    let traffic = |quantum: Time| {
        let (mut babbler, mut a, mut b) =
            (Babbler::new(BIT, 0.7, Babbler::foreign(), 3), HostNode::new(BIT), HostNode::new(BIT));
        for n in 0..100 {
            a.send(standard(n, &[n as u8]), Time::from_micros(333) * u64::from(n));
            b.send(standard(0x7F0 - n, &[]), Time::from_micros(277) * u64::from(n));
        }
        let mut bus = Bus::new();
        bus.faults.noise(5, 0.1);
        let (mut now, end, mut events) = (Time::ZERO, Time::from_millis(50), Vec::new());
        while now < end {
            now = (now + quantum).min(end);
            events.extend(run(&mut bus, &mut [&mut babbler, &mut a, &mut b], now));
        }
        events
    };
    let whole = traffic(Time::from_millis(50));
    assert!(whole.len() > 200);
    assert_eq!(traffic(BIT * 12), whole);
    assert_eq!(traffic(Time(BIT.0 / 3)), whole);
}
