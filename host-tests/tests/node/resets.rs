//! Values after a reset. A reset of the communication does not change the objects from 2000h on (CiA 301, 7.3.2.2.3).

use host_tests::bench::{Bench, raw};
use node::Personality;

const RESET_COMMUNICATION: u8 = 0x82;
/// The event timer of the first TPDO (CiA 406), which is a communication object.
const CYCLIC_TIMER: u16 = 0x6200;

type Values = Vec<((u16, u8), Vec<u8>)>;

/// Gives each object from 2000h on, except the personality, another value. Returns the values of those that take one.
fn changed(bench: &mut Bench, personality: Personality) -> Values {
    let entries = personality.dictionary().entries().map(|entry| (entry.index(), entry.sub()));
    let objects = entries.filter(|(index, _)| *index > 0x2000 && *index != CYCLIC_TIMER);
    let changed: Vec<_> = objects.filter(|at| takes_another_value(bench, *at)).collect();
    assert!(changed.len() >= 5, "{changed:X?}");
    changed.into_iter().map(|at| (at, bench.read(at.0, at.1).unwrap())).collect()
}

fn takes_another_value(bench: &mut Bench, (index, sub): (u16, u8)) -> bool {
    let Ok(before) = bench.read(index, sub) else { return false };
    let mut changes = (0..before.len()).flat_map(|place| [1, 2, 0x40].map(|flip| (place, flip)));
    changes.any(|(place, flip)| {
        let mut other = before.clone();
        other[place] ^= flip;
        bench.write(index, sub, &other).is_ok()
    })
}

/// The objects that no longer have their values.
fn lost(bench: &mut Bench, expected: &Values) -> Values {
    expected.iter().filter(|(at, value)| bench.read(at.0, at.1).as_ref() != Ok(value)).cloned().collect()
}

fn reset_communication(bench: &mut Bench) {
    bench.nmt(RESET_COMMUNICATION);
    bench.restart();
}

#[test]
fn a_reset_of_the_communication_keeps_every_object_from_2000h_on() {
    for personality in Personality::ALL {
        for id in [1, 16, 127] {
            let mut bench = Bench::booted_at(personality, id);
            let expected = changed(&mut bench, personality);
            reset_communication(&mut bench);
            assert_eq!(lost(&mut bench, &expected), [], "{personality:?} {id}, not saved");
        }
    }
}

/// The defaults of the application are in force after a reset of the node (CMP 8271, 1011h:3).
#[test]
fn parameters_to_be_restored_stay_until_the_node_is_reset() {
    for personality in Personality::ALL {
        for id in [1, 16, 127] {
            let mut bench = Bench::booted_at(personality, id);
            let expected = changed(&mut bench, personality);
            bench.write(0x1010, 1, b"save").unwrap();
            bench.write(0x1011, 3, b"load").unwrap();
            reset_communication(&mut bench);
            assert_eq!(lost(&mut bench, &expected), [], "{personality:?} {id}");
        }
    }
}

/// A preset, by SDO or by a button, stores the whole application group, which would end the restore.
#[test]
fn no_preset_ends_a_restore_before_the_reset() {
    let presets = [
        (Personality::Encoder, (0x6003, 0)),
        (Personality::Encoder, (0x6010, 1)),
        (Personality::Combined, (0x6003, 0)),
        (Personality::Lift, (0x6382, 1)),
    ];
    for (personality, (index, sub)) in presets {
        for restored in [1, 3] {
            let booted = || {
                let mut bench = Bench::booted_as(personality);
                (0..20).for_each(|_| bench.sample(&raw(0.0, 298.15)));
                bench
            };
            let preset = 77_u32.to_le_bytes();
            let mut bench = booted();
            assert_eq!(bench.write(index, sub, &preset), Ok(()), "{personality:?}");
            bench.write(0x1011, restored, b"load").unwrap();
            let name = format!("{personality:?}, {index:X}h, 1011h:{restored}");
            assert_eq!(bench.write(index, sub, &preset), Err(0x0800_0022), "{name}");
            reset_communication(&mut bench);
            assert_eq!(bench.write(index, sub, &preset), Err(0x0800_0022), "{name}");
            bench.write(0x1010, 3, b"save").unwrap();
            assert_eq!(bench.write(index, sub, &preset), Ok(()), "a save ends the restore, {name}");
            bench.write(0x1011, restored, b"load").unwrap();
            let mut bench = bench.power_cycled();
            (0..20).for_each(|_| bench.sample(&raw(0.0, 298.15)));
            assert_eq!(bench.write(index, sub, &preset), Ok(()), "{name}");
        }
    }
}
