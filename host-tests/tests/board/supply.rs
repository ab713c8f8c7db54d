//! A supply that falls and rises, with the brown-out reset off and at each of its levels.

use canbus::Time;
use programmer::protect::OptionBytes;
use sim::world::World;
use workbench::bringup::Probe;

use crate::encoder::stimulate;
use crate::support::{Master, SECOND, read, running, write};

/// A value without effect on the measurement: the heartbeat time, 1017h.
const SAVED: (u16, u8) = (0x1017, 0);
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e'];
/// 2001h:10.
const REFUSED: (u16, u8) = (0x2001, 10);
/// Saves, and returns the response; empty without one.
fn save(world: &mut World, master: &Master) -> Vec<u8> {
    master.heard(world, 0x581);
    master.send(world, 0x601, &SAVE);
    for _ in 0..300 {
        world.run_until(world.now() + Time::from_millis(1));
        if let Some(frame) = master.heard(world, 0x581).first() {
            return frame.bytes().to_vec();
        }
    }
    Vec::new()
}

fn set_brown_out_level(world: &mut World, level: u8) {
    let options = OptionBytes::FACTORY.with_brown_out_level(level);
    programmer::protect::program(&mut Probe(world), options).unwrap();
    world.run_until(world.now() + SECOND);
}

#[test]
fn a_save_with_a_low_supply_is_refused_and_counted() {
    let mut world = running();
    let master = Master::join(&mut world);
    write(&mut world, &master, SAVED, 2, 300);
    stimulate(&mut world, "supply", "const:2.8");
    assert_eq!(save(&mut world, &master), [0x80, 0x10, 0x10, 2, 0, 0, 0x06, 0x06]);
    assert!(read(&mut world, &master, REFUSED) > 0);
    stimulate(&mut world, "supply", "const:3.3");
    assert_eq!(save(&mut world, &master)[0], 0x60, "the supply is back");
}

/// A ramp while a client saves again and again: afterwards the values of one save are there, the last one with a
/// positive response or a later one. Below 2.7 V the core executes wrong code, unless the brown-out reset holds it.
/// The rules of the emulated board see a word that is programmed below 2.7 V.
#[test]
fn a_supply_that_fails_slowly_leaves_one_set_of_values() {
    for level in 0..=3 {
        let mut world = running();
        let master = Master::join(&mut world);
        set_brown_out_level(&mut world, level);
        stimulate(&mut world, "supply", "ramp:3.3,1.5,0.7");
        let (mut confirmed, mut newest) = (0, 0);
        for value in 301.. {
            let before = world.now();
            newest = value;
            master.heard(&mut world, 0x581);
            let [low, high] = u16::to_le_bytes(value);
            master.send(&mut world, 0x601, &[0x2B, 0x17, 0x10, 0, low, high, 0, 0]);
            world.run_until(before + Time::from_millis(3));
            match save(&mut world, &master).first() {
                Some(0x60) => confirmed = value,
                Some(_) => {}
                None => break,
            }
        }
        assert!(confirmed > 301, "level {level}: no save was in time");
        assert_eq!(world.bad_reads(0) > 0, level < 3, "level {level}: {} wrong reads", world.bad_reads(0));
        stimulate(&mut world, "supply", "ramp:1.5,3.3,0.2");
        world.run_until(world.now() + SECOND * 2);
        let value = read(&mut world, &master, SAVED) & 0xFFFF;
        let expected = u32::from(confirmed)..=u32::from(newest);
        assert!(expected.contains(&value), "level {level}: {value} is not in {expected:?}");
    }
}
