//! COB-IDs and the node-ID: a CAN-ID that is pre-defined for the node follows its node-ID.

use canopen::Frame;
use host_tests::bench::Bench;
use node::Personality;

const OFF: u32 = 1 << 31;
const NO_REMOTE: u32 = 1 << 30;
const ID_BITS: u32 = 0x7FF;

fn number(bench: &mut Bench, (index, sub): (u16, u8)) -> u32 {
    let bytes = bench.read(index, sub).unwrap();
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn write(bench: &mut Bench, (index, sub): (u16, u8), value: u32) -> Result<(), u32> {
    bench.write(index, sub, &value.to_le_bytes())
}

/// The COB-IDs whose CAN-IDs differ between two nodes as delivered.
fn relative(personality: Personality) -> Vec<(u16, u8)> {
    let [mut one, mut other] = [1, 2].map(|id| Bench::booted_at(personality, id));
    let entries = personality.dictionary().entries().map(|entry| (entry.index(), entry.sub()));
    let entries = entries.filter(|at| *at == (0x1014, 0) || matches!(at, (0x1400..=0x19FF, 1)));
    entries.filter(|at| number(&mut one, *at) != number(&mut other, *at)).collect()
}

/// Stores a node-ID by LSS, and switches the power off and on.
fn moved(mut bench: Bench, node_id: u8) -> Bench {
    for request in [[0x04, 1], [0x11, node_id], [0x17, 0], [0x04, 0]] {
        let [command, argument] = request;
        bench.receive(&Frame::new(0x7E5, &[command, argument, 0, 0, 0, 0, 0, 0]).unwrap());
    }
    let bench = bench.power_cycled();
    assert_eq!(bench.id(), u16::from(node_id));
    bench
}

#[test]
fn a_pre_defined_can_id_follows_the_node_id_whatever_its_flags_are() {
    for personality in Personality::ALL {
        let relative = relative(personality);
        assert!(relative.len() >= 3, "{personality:?}: {relative:X?}");
        for (from, to) in [(1, 16), (16, 127), (127, 1)] {
            for flags in [0, NO_REMOTE, OFF, OFF | NO_REMOTE] {
                let mut bench = Bench::booted_at(personality, from);
                let mut expected = vec![];
                for at in &relative {
                    let id = number(&mut bench, *at) & ID_BITS;
                    let _ = write(&mut bench, *at, OFF | id);
                    let _ = write(&mut bench, *at, flags | id);
                    let kept = number(&mut bench, *at);
                    expected.push(kept - u32::from(from) + u32::from(to));
                }
                bench.write(0x1010, 1, b"save").unwrap();
                let mut bench = moved(bench, to);
                let found: Vec<_> = relative.iter().map(|at| number(&mut bench, *at)).collect();
                assert_eq!(found, expected, "{personality:?}, {from} to {to}, flags {flags:X}h");
                let again = moved(bench, from);
                let mut again = again;
                for (at, value) in relative.iter().zip(&expected) {
                    let back = value + u32::from(from) - u32::from(to);
                    assert_eq!(number(&mut again, *at), back, "{personality:?}, back to {from}");
                }
            }
        }
    }
}

/// The rows of which the profile fixes the CAN-ID have no other one.
#[test]
fn another_can_id_is_absolute() {
    for personality in Personality::ALL {
        for id in [1, 16, 127] {
            let mut bench = Bench::booted_at(personality, id);
            let mut changed = vec![];
            for at in relative(personality) {
                let other = 0x6A0 + u32::from(at.0 & 0x1F);
                if write(&mut bench, at, OFF).is_ok() && write(&mut bench, at, OFF | other).is_ok() {
                    changed.push((at, OFF | other));
                }
            }
            assert!(!changed.is_empty());
            bench.write(0x1010, 1, b"save").unwrap();
            let mut bench = moved(bench, 99);
            for (at, value) in changed {
                assert_eq!(number(&mut bench, at), value, "{personality:?} {id}: {at:X?}");
            }
        }
    }
}

#[test]
fn emcy_without_a_can_id_is_accepted_as_for_a_pdo() {
    for personality in Personality::ALL {
        for id in [1, 16, 127] {
            let mut bench = Bench::booted_at(personality, id);
            assert_eq!(write(&mut bench, (0x1014, 0), OFF), Ok(()), "{personality:?} {id}");
            assert_eq!(number(&mut bench, (0x1014, 0)), OFF);
            assert_eq!(write(&mut bench, (0x1014, 0), 0x80 + u32::from(id)), Ok(()), "{personality:?} {id}");
        }
    }
}
