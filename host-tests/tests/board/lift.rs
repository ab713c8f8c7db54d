//! A lift node on the emulated board: as delivered, from the button's contact to a frame, and from a frame to the
//! lamp's pin.

use std::ops::Range;

use canbus::{StandardId, Time};
use fastrand::Rng;
use host_tests::calls::{Transition, verify};
use host_tests::thorough::either;
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, world};

/// TPDO 130 of node 1, and the virtual outputs of the lift.
const INPUT: u16 = 0x481;
const OUTPUT: u16 = 0x400;
/// Pins of the lamps at port C.
const LAMPS: [u32; 2] = [0, 1];

/// A word with this last byte.
fn word(last: u8) -> [u8; 6] {
    [last, 0, 0, 0, 0, 1]
}

/// Chooses the virtual devices of a node: bits 0 position, 1 load, 2 input panel, 3 output panel.
fn choose(world: &mut World, master: &Master, node: u8, devices: u8) {
    assert_eq!(master.ask(world, node, &[0x2F, 0x05, 0x23, 0, devices, 0, 0, 0])[0], 0x60);
}

/// Writes a word by segmented transfer.
fn write(world: &mut World, master: &Master, index: u16, sub: u8, last: u8) {
    let [low, high] = index.to_le_bytes();
    assert_eq!(master.ask(world, 1, &[0x21, low, high, sub, 6, 0, 0, 0])[0], 0x60);
    let [a, b, c, d, e, f] = word(last);
    assert_eq!(master.ask(world, 1, &[0x03, a, b, c, d, e, f, 0])[0], 0x20);
}

fn lamps(world: &mut World) -> [bool; 2] {
    LAMPS.map(|pin| world.machine(0).peripherals().output('C', pin) == Some(true))
}

/// Pushes or releases a button; returns the frames that follow, each with its time in milliseconds after the push.
fn push(world: &mut World, master: &Master, spec: &str) -> Vec<(u64, Vec<u8>)> {
    world.take_frames();
    let pushed = world.now();
    world.apply(&Stimulus::parse("button", spec).unwrap()).unwrap();
    world.run_until(pushed + Time::from_millis(40));
    master.heard(world, INPUT);
    let id = canbus::StandardId::new(INPUT).unwrap().into();
    let frames = world.take_frames().into_iter().filter(|stamped| stamped.frame.id() == id);
    frames.map(|sent| (sent.at.since(pushed).as_micros() / 1000, sent.frame.bytes().to_vec())).collect()
}

#[test]
fn buttons_are_virtual_inputs_and_lamps_follow_virtual_outputs() {
    // The button is held from power-on.
    let mut world = world("--bitrate 1000 --node 1:lift --button 2:down");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    choose(&mut world, &master, 1, 0x0C);
    for sub in 1..=4 {
        write(&mut world, &master, 0x2320, sub, 0x10 + sub);
        write(&mut world, &master, 0x2321, sub, 0x20 + sub);
    }
    master.heard(&mut world, INPUT);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(20));
    let first = master.heard(&mut world, INPUT);
    let first: Vec<&[u8]> = first.iter().map(canbus::Frame::bytes).collect();
    assert_eq!(first, [word(0x11), word(0x14)], "all inputs, and button 2 is pressed");

    for (spec, last) in [("1:down", 0x12), ("1:up", 0x11), ("2:up", 0x13), ("2:down", 0x14)] {
        let sent = push(&mut world, &master, spec);
        // The contact bounces for 3 ms; the node accepts the state after 10 ms without a change.
        let [(at, bytes)] = &sent[..] else { panic!("{spec}: {sent:?}") };
        assert_eq!(*bytes, word(last), "{spec}");
        assert!((10..=15).contains(at), "{spec}: {at} ms");
    }

    assert_eq!(lamps(&mut world), [false, false]);
    for (last, lit) in [
        (0x22, [true, false]),
        (0x24, [true, true]),
        (0x77, [true, true]),
        (0x21, [false, true]),
        (0x23, [false, false]),
    ] {
        master.send(&mut world, OUTPUT, &word(last));
        world.run_until(world.now() + Time::from_millis(2));
        assert_eq!(lamps(&mut world), lit, "{last:x}h");
    }
}

/// Also from a producer without an RPDO in this node: the acceptance filters must pass its frames.
#[test]
fn multiplexed_pdos_of_any_node_light_a_lamp() {
    let mut world = world("--bitrate 1000 --node 1:lift");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    for (producer, lit) in [(8, 1), (0, 0), (64, 0), (127, 1), (2, 0)] {
        if producer != 0 {
            master.send(&mut world, 0x500 + producer, &[0x80, 0x22, 0x23, 1, lit, 0, 0, 0]);
        }
        world.run_until(world.now() + Time::from_millis(2));
        let expected = if producer == 0 { 1 } else { lit };
        assert_eq!(lamps(&mut world)[0], expected == 1, "node {producer}");
    }
}

/// The numbers of frames with these CAN-IDs, which only one node in a lift may produce.
fn fixed(world: &mut World, ids: [u16; 2]) -> [usize; 2] {
    let frames = world.take_frames();
    ids.map(|id| {
        let id = StandardId::new(id).unwrap().into();
        frames.iter().filter(|stamped| stamped.frame.id() == id).count()
    })
}

/// Two nodes as delivered, with different measured values, start together without knowledge of each other.
#[test]
fn two_boards_as_delivered_do_not_disturb_each_other() {
    let mut world = world(
        "--bitrate 1000 --node 4:lift --node 5:lift --shaft 4=rpm:60 --shaft 5=rpm:-90 \
         --pressure 4=const:500000 --pressure 5=const:300000 --button 4=1:down",
    );
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(SECOND * 4);
    let delivered = world.summary(1.0, 0);
    assert_eq!(delivered.bus.errors, 0, "{delivered}");
    assert_eq!(delivered.nodes.iter().map(|node| node.heard.emcys).max(), Some(0), "{delivered}");
    assert_eq!(fixed(&mut world, [0x188, 0x18C]), [0, 0]);

    choose(&mut world, &master, 4, 0x01);
    choose(&mut world, &master, 5, 0x02);
    world.run_until(SECOND * 6);
    let [loads, positions] = fixed(&mut world, [0x188, 0x18C]);
    assert!(loads > 0 && positions > 100, "{loads}, {positions}");
    assert_eq!(world.summary(1.0, 0).bus.errors, 0);
}

/// An input panel unit with two buttons with words in the public structure, and these times of its TPDO.
fn panel(world: &mut World, master: &Master, node: u8, inhibit: u16, event_timer: u16) {
    choose(world, master, node, 0x04);
    for button in 1..=2 {
        assert_eq!(master.ask(world, node, &[0x21, 0x00, 0x61, button, 6, 0, 0, 0])[0], 0x60);
        assert_eq!(master.ask(world, node, &[0x03, 5, button, 1, 0, 1, 0, 0])[0], 0x20);
    }
    let input = 0x80 + node;
    let times = [(3, inhibit.to_le_bytes()), (5, event_timer.to_le_bytes())];
    assert_eq!(master.ask(world, node, &[0x23, 0x81, 0x18, 1, input, 4, 0, 0xC0])[0], 0x60);
    for (sub, [low, high]) in times {
        assert_eq!(master.ask(world, node, &[0x2B, 0x81, 0x18, sub, low, high, 0, 0])[0], 0x60);
    }
    assert_eq!(master.ask(world, node, &[0x23, 0x81, 0x18, 1, input, 4, 0, 0x40])[0], 0x60);
}

/// The button transitions that a panel has reported in these frames.
fn told(frames: &[canbus::Stamped], node: u8) -> Vec<Transition> {
    let id = StandardId::new(0x480 + u16::from(node)).unwrap().into();
    let words = frames.iter().filter(|stamped| stamped.frame.id() == id);
    let word = |stamped: &canbus::Stamped| {
        let [5, button @ 1..=2, 1, 0, 1, state @ 0..=1] = *stamped.frame.bytes() else {
            panic!("{:x?}", stamped.frame.bytes())
        };
        Transition { at: stamped.at.as_micros(), button: usize::from(button) - 1, is_pressed: state == 1 }
    };
    words.map(word).collect()
}

/// The number of each button, 1 or 2, and whether it is pressed.
fn texts(told: &[Transition]) -> Vec<(usize, bool)> {
    told.iter().map(|word| (word.button + 1, word.is_pressed)).collect()
}

/// The sequences in which calls were lost in the past: changes within the inhibit time, and a press between two events
/// of the timer.
#[test]
fn every_call_reaches_the_bus_whatever_the_times_of_the_pdo() {
    let mut world = world("--bitrate 250 --node 1:lift");
    let master = Master::join_at(&mut world, 250_000);
    world.run_until(SECOND);
    for (inhibit, event_timer, gap) in [(2000, 0, 40), (0, 500, 75)] {
        panel(&mut world, &master, 1, inhibit, event_timer);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        world.run_until(world.now() + SECOND);
        world.take_frames();
        let begun = world.now();
        for spec in ["1:down", "2:down", "1:up", "2:up"] {
            world.apply(&Stimulus::parse("button", spec).unwrap()).unwrap();
            world.run_until(world.now() + Time::from_millis(gap));
        }
        world.run_until(begun + Time::from_millis(990));
        let mut told = texts(&told(&world.take_frames(), 1));
        // The event timer may have repeated the previous word.
        told.drain(..told.iter().take_while(|word| **word == (2, false)).count());
        let expected = [(1, true), (2, true), (1, false), (2, false)];
        // With an event timer the last word is repeated.
        assert_eq!(told[..4], expected, "{inhibit}, {event_timer}: {told:?}");
        assert!(told[4..].iter().all(|word| *word == expected[3]), "{told:?}");
        master.send(&mut world, 0, &[0x80, 0]);
        world.run_until(world.now() + Time::from_millis(20));
    }
}

/// Removes the frames that the bus has repeated: a transmitter that reads the last bit of its frame wrongly sends the
/// frame again, although other nodes have received it (ISO 11898-1). This happens only in noise. Without a repetition,
/// two equal words never follow each other.
fn once(words: Vec<Transition>, noise: &[Range<u64>]) -> Vec<Transition> {
    let mut last: Option<Transition> = None;
    let is_new = |word: &Transition| {
        let before = last.replace(*word);
        let is_same =
            |before: Transition| (before.button, before.is_pressed) == (word.button, word.is_pressed);
        let in_noise = |before: Transition| noise.iter().any(|time| time.contains(&before.at));
        !before.is_some_and(|before| is_same(before) && in_noise(before))
    };
    words.into_iter().filter(is_new).collect()
}

/// Two panels, four buttons, a bus that is never idle, an inhibit time of 200 ms, and noise that sometimes makes both
/// nodes bus-off: every transition arrives once and in order, or is covered by a later full state.
#[test]
fn random_presses_on_a_full_bus_with_bus_off_in_between() {
    const NODES: [u8; 2] = [1, 2];
    let presses = either(12, 2500);
    let mut world = world("--bitrate 125 --load 100 --node 1:lift --node 2:lift");
    let master = Master::join_at(&mut world, 125_000);
    world.run_until(SECOND);
    NODES.iter().for_each(|&node| panel(&mut world, &master, node, 2000, 0));
    world.take_frames();
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    let mut rng = Rng::with_seed(7);
    let mut frames = vec![];
    let mut happened = [vec![], vec![]];
    let mut pressed = [[false; 2]; 2];
    let mut noise = vec![];
    while happened.iter().map(Vec::len).sum::<usize>() < 8 * presses {
        // Each button moves at most every 30 ms, so that the node accepts each state.
        for _ in 0..rng.u32(1..40) {
            let pause = if rng.bool() { 30..60 } else { 100..800 };
            for (place, node) in NODES.iter().enumerate() {
                let button = rng.usize(..2);
                let is_pressed = !pressed[place][button];
                pressed[place][button] = is_pressed;
                let state = if is_pressed { "down" } else { "up" };
                let spec = format!("{node}={}:{state}", button + 1);
                world.apply(&Stimulus::parse("button", &spec).unwrap()).unwrap();
                happened[place].push(Transition { at: world.now().as_micros(), button, is_pressed });
            }
            world.run_until(world.now() + Time::from_millis(rng.u64(pause)));
            frames.extend(world.take_frames());
        }
        // Both nodes are bus-off and recover at most 3.2 s later. They are then started again, because the error had
        // led them to Pre-operational.
        let from = world.now();
        world.bus().faults.noise(rng.u64(..), 1.0);
        world.run_until(from + Time::from_millis(300));
        world.bus().faults.quiet();
        // A frame that has begun in the noise ends at most 2 ms later.
        noise.push(from.as_micros()..world.now().as_micros() + 2000);
        world.run_until(world.now() + SECOND * 4);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        world.run_until(world.now() + Time::from_millis(rng.u64(1..500)));
        frames.extend(world.take_frames());
    }
    world.run_until(world.now() + SECOND * 12);
    frames.extend(world.take_frames());
    for (happened, node) in happened.iter().zip(NODES) {
        let verdict = verify(happened, &once(told(&frames, node), &noise), 20_000_000)
            .unwrap_or_else(|error| panic!("{error}"));
        println!("node {node}: {} transitions, {verdict:?}", happened.len());
        assert!(verdict.told > 0 && verdict.full_states > 1, "{verdict:?}");
    }
    let summary = world.summary(1.0, 0);
    assert!(summary.nodes.iter().all(|node| node.incidents.is_empty()), "{summary}");
}
