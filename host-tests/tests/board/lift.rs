//! The panel of a lift node on the emulated board: from the button's contact to a frame, and from a frame to the lamp's pin.

use canbus::Time;
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, world};

/// TPDO 130 of node 1, and the virtual outputs of the lift.
const INPUT: u16 = 0x481;
const OUTPUT: u16 = 0x400;
/// Pins of the lamps at port C.
const LAMPS: [u32; 2] = [0, 1];

/// A word that ends in this byte.
fn word(last: u8) -> [u8; 6] {
    [last, 0, 0, 0, 0, 1]
}

/// Writes a word, which needs a segmented transfer.
fn write(world: &mut World, master: &Master, index: u16, sub: u8, last: u8) {
    let [low, high] = index.to_le_bytes();
    assert_eq!(master.ask(world, 1, &[0x21, low, high, sub, 6, 0, 0, 0])[0], 0x60);
    let [a, b, c, d, e, f] = word(last);
    assert_eq!(master.ask(world, 1, &[0x03, a, b, c, d, e, f, 0])[0], 0x20);
}

fn lamps(world: &mut World) -> [bool; 2] {
    LAMPS.map(|pin| world.machine(0).peripherals().output('C', pin) == Some(true))
}

/// What is sent of the buttons when one of them moves, and when: milliseconds after the push.
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
    // Held from power-on.
    let mut world = world("--bitrate 1000 --node 1:lift --button 2:down");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    for sub in 1..=4 {
        write(&mut world, &master, 0x2320, sub, 0x10 + sub);
        write(&mut world, &master, 0x2321, sub, 0x20 + sub);
    }
    master.heard(&mut world, INPUT);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(20));
    let first = master.heard(&mut world, INPUT);
    assert_eq!(first.last().unwrap().bytes(), word(0x14), "button 2 is pressed");

    for (spec, last) in [("1:down", 0x12), ("1:up", 0x11), ("2:up", 0x13), ("2:down", 0x14)] {
        let sent = push(&mut world, &master, spec);
        // The contact bounces for 3 ms and is believed after 10 ms without.
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
