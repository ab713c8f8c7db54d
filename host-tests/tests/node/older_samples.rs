//! Commands on the present value (zero, tare, preset, reference weight) right after another parameter of that value: the last
//! sample still has the old one. The command is refused until a sample has the new one, or is right.

use host_tests::bench::{Bench, raw};
use node::Personality;

const DEVICE_STATE: u32 = 0x0800_0022;
/// Samples that may have been taken with the old parameters.
const OLDER: usize = 3;

type Write = (u16, u8, Vec<u8>);

/// A change, and a command that makes a value become another one.
struct Case {
    personality: Personality,
    change: Write,
    command: Write,
    value: (u16, u8),
    expected: Vec<u8>,
}

fn sample(bench: &mut Bench) {
    bench.sample(&raw(300_000.0, 298.15));
}

fn of_pressure(personality: Personality, shift: u16) -> Vec<Case> {
    let real = |value: f32| value.to_le_bytes().to_vec();
    let changes = [
        (0x6131 + shift, 1, 0x0022_0000_u32.to_le_bytes().to_vec()),
        (0x6126 + shift, 1, real(10.0)),
        (0x6127 + shift, 1, real(1e5)),
    ];
    let commands = [(0x6125 + shift, 1, b"zero".to_vec()), (0x6139 + shift, 1, b"tare".to_vec())];
    let value = (0x6130 + shift, 1);
    let pairs =
        changes.into_iter().flat_map(|change| commands.clone().map(|command| (change.clone(), command)));
    pairs
        .map(|(change, command)| Case { personality, change, command, value, expected: vec![0; 4] })
        .collect()
}

fn of_lift() -> Vec<Case> {
    let preset = (0x6382, 1, 5000_u32.to_le_bytes().to_vec());
    let weight = (0x6486, 0, vec![75, 0]);
    let case = |change, command: &Write, value| {
        let (personality, command) = (Personality::Lift, command.clone());
        let expected = command.2.clone();
        Case { personality, change, command, value, expected }
    };
    vec![
        case((0x6384, 1, vec![50, 0]), &preset, (0x6383, 1)),
        case((0x2300, 0, 300_000_u32.to_le_bytes().to_vec()), &preset, (0x6383, 1)),
        case((0x2311, 4, 1000.0_f32.to_le_bytes().to_vec()), &weight, (0x6480, 1)),
        case((0x2312, 0, 50.0_f32.to_le_bytes().to_vec()), &weight, (0x6480, 1)),
    ]
}

fn of_encoder(personality: Personality) -> Vec<Case> {
    let change = (0x2100, 1, vec![4]);
    let position = 777_u32.to_le_bytes().to_vec();
    let commands = [(0x6003, 0, position.clone()), (0x6010, 1, position.clone())];
    commands
        .map(|command| {
            let (change, expected) = (change.clone(), position.clone());
            Case { personality, change, command, value: (0x6004, 0), expected }
        })
        .into()
}

fn cases() -> Vec<Case> {
    let mut cases = of_pressure(Personality::Pressure, 0);
    cases.extend(of_pressure(Personality::Combined, 0x800));
    cases.extend(of_lift());
    cases.extend(of_encoder(Personality::Encoder));
    cases.extend(of_encoder(Personality::Combined));
    cases
}

impl Case {
    fn booted(&self, id: u8) -> Bench {
        let mut bench = Bench::booted_at(self.personality, id);
        if self.personality == Personality::Lift {
            bench.write(0x2305, 0, &[3]).unwrap();
            bench.write(0x2301, 1, &[1]).unwrap();
        }
        bench.encoder.counter = 1200;
        (0..20).for_each(|_| sample(&mut bench));
        bench
    }

    fn write(bench: &mut Bench, (index, sub, bytes): &Write) -> Result<(), u32> {
        bench.write(*index, *sub, bytes)
    }

    /// After the command: whether the value is the expected one, in samples with the new parameters too.
    fn holds(&self, bench: &mut Bench) -> bool {
        (0..2 * OLDER).for_each(|_| sample(bench));
        let value = bench.read(self.value.0, self.value.1).unwrap();
        if matches!(self.command.0 & 0xF7FF, 0x6125 | 0x6139) {
            // The last digit of a REAL32 of 300,000.
            f32::from_le_bytes(value.try_into().unwrap()).abs() < 0.1
        } else {
            value[..self.expected.len()] == self.expected
        }
    }
}

#[test]
fn a_command_right_after_another_parameter_is_refused_or_right() {
    for case in cases() {
        for (id, samples) in [(1, 0), (16, 1), (127, 2)] {
            let mut bench = case.booted(id);
            let name = format!("{:?}: {:X?} and {:X?}", case.personality, case.change, case.command);
            assert_eq!(Case::write(&mut bench, &case.change), Ok(()), "{name}");
            (0..samples).for_each(|_| sample(&mut bench));
            match Case::write(&mut bench, &case.command) {
                Err(DEVICE_STATE) => {}
                result => assert_eq!((result, case.holds(&mut bench)), (Ok(()), true), "{name}"),
            }
        }
    }
}

#[test]
fn a_command_after_a_sample_with_the_new_parameter_is_right() {
    for case in cases() {
        let mut bench = case.booted(5);
        let name = format!("{:?}: {:X?} and {:X?}", case.personality, case.change, case.command);
        assert_eq!(Case::write(&mut bench, &case.change), Ok(()), "{name}");
        (0..2 * OLDER).for_each(|_| sample(&mut bench));
        assert_eq!(Case::write(&mut bench, &case.command), Ok(()), "{name}");
        assert!(case.holds(&mut bench), "{name}");
    }
}
