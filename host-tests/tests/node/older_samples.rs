//! Commands on the present value (zero, tare, preset, direction, reference weight) right after another parameter of that
//! value: the last sample still has the old one. The command is refused until a sample has the new one, or is right.

use host_tests::bench::{Bench, raw};
use node::Personality;
use profiles::board::SsiFrame;

const DEVICE_STATE: u32 = 0x0800_0022;
/// Samples that may have been taken with the old parameters.
const OLDER: usize = 3;

type Write = (u16, u8, Vec<u8>);

/// The right value after a command.
#[derive(Clone)]
enum Right {
    Value(Vec<u8>),
    /// The last digit of a REAL32 of 300,000.
    Zero,
    /// The value that the change alone gives.
    Kept,
}

/// The sensors and the virtual devices of the node.
#[derive(Clone, Copy, PartialEq)]
enum Sensors {
    Incremental,
    Ssi,
    /// An SSI sensor as channel 2, beside the incremental one.
    SsiAsSecond,
}

/// A change, and a command that makes a value become another one, or keeps it.
struct Case {
    personality: Personality,
    sensors: Sensors,
    change: Write,
    command: Write,
    value: (u16, u8),
    right: Right,
}

fn sample(bench: &mut Bench) {
    bench.sample(&raw(300_000.0, 298.15));
}

fn real(value: f32) -> Vec<u8> {
    value.to_le_bytes().to_vec()
}

fn word(value: u32) -> Vec<u8> {
    value.to_le_bytes().to_vec()
}

fn of_pressure(personality: Personality, shift: u16) -> Vec<Case> {
    let mut cases = vec![];
    for (sub, unit) in [(1, 0x0022_0000), (2, 0x0005_0000)] {
        let changes = [
            (0x6131 + shift, sub, word(unit)),
            (0x6126 + shift, sub, real(10.0)),
            (0x6127 + shift, sub, real(1e5)),
            (0x6124 + shift, sub, real(7.0)),
            (0x2210, sub, real(7.0)),
            (0x61A0 + shift, sub, vec![2]),
            (0x61A1 + shift, sub, vec![9]),
            (0x2200, 2, real(2.0e6)),
            (0x2201, 3, real(5.0)),
        ];
        for change in changes {
            for command in [(0x6125 + shift, sub, b"zero".to_vec()), (0x6139 + shift, sub, b"tare".to_vec())]
            {
                let (change, value, right) = (change.clone(), (0x6130 + shift, sub), Right::Zero);
                cases.push(Case {
                    personality,
                    sensors: Sensors::Incremental,
                    change,
                    command,
                    value,
                    right,
                });
            }
        }
    }
    cases
}

/// 2100h to 2105h of a channel, and the SSI word.
fn descriptions(channel: u8) -> Vec<Write> {
    vec![
        (0x2100, channel, vec![4]),
        (0x2101, channel, word(8192)),
        (0x2102, channel, vec![0, 1]),
        (0x2103, 1, vec![10]),
        (0x2103, 2, vec![12]),
        (0x2103, 3, vec![0]),
        (0x2103, 4, vec![1]),
        (0x2103, 5, vec![1]),
        (0x2104, channel, word(1000)),
        (0x2105, 0, vec![0]),
    ]
}

const SENSORS: [(Sensors, u8); 4] =
    [(Sensors::Incremental, 1), (Sensors::Ssi, 1), (Sensors::SsiAsSecond, 1), (Sensors::SsiAsSecond, 2)];

fn of_lift() -> Vec<Case> {
    let personality = Personality::Lift;
    let weight = (0x6486, 0, vec![75, 0]);
    let mut cases: Vec<Case> = [
        (0x2200, 2, real(2.0e6)),
        (0x2201, 3, real(5.0)),
        (0x2310, 1, vec![1]),
        (0x2310, 2, vec![9]),
        (0x2311, 4, real(1000.0)),
        (0x2312, 0, real(50.0)),
        (0x6384, 1, vec![50, 0]),
    ]
    .into_iter()
    .map(|change| {
        let (command, right) = (weight.clone(), Right::Value(weight.2.clone()));
        Case { personality, sensors: Sensors::Incremental, change, command, value: (0x6480, 1), right }
    })
    .collect();
    for (sensors, channel) in SENSORS {
        let mut changes = descriptions(channel);
        changes.extend([
            (0x6384, 1, vec![50, 0]),
            (0x6384, 2, vec![50, 0]),
            (0x2300, 0, word(300_000)),
            (0x2301, 1, vec![1]),
            (0x2302, 1, word(5)),
            (0x6380, 1, vec![8, 0]),
            (0x2311, 4, real(1000.0)),
        ]);
        for change in changes {
            let (preset, turn) = (word(50), vec![8, 0]);
            for (command, right) in
                [((0x6382, 1, preset.clone()), Right::Value(preset)), ((0x6380, 1, turn), Right::Kept)]
            {
                let (change, value) = (change.clone(), (0x6383, 1));
                cases.push(Case { personality, sensors, change, command, value, right });
            }
        }
    }
    cases
}

fn of_encoder(personality: Personality) -> Vec<Case> {
    let mut cases = vec![];
    for (sensors, channel) in SENSORS {
        let mut changes = descriptions(channel);
        changes.extend([
            (0x6000, 0, vec![1, 0]),
            (0x6001, 0, word(1000)),
            (0x6002, 0, word(100_000)),
            (0x2114, 0, vec![2, 0]),
        ]);
        for change in changes {
            for (index, sub) in
                [(0x6003, 0), (0x6010, channel)].into_iter().filter(|at| channel == at.1.max(1))
            {
                let (change, preset) = (change.clone(), word(777));
                let (command, right) = ((index, sub, preset.clone()), Right::Value(preset));
                cases.push(Case { personality, sensors, change, command, value: (0x6020, channel), right });
            }
        }
    }
    cases
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
        bench.encoder.counter = 1200;
        // The rest level, a word that is good in each frame of these tests, and the low level.
        bench.encoder.ssi = Some(SsiFrame { bits: 1 << 63 | 0b11 << 49, clocks: 64 });
        match self.sensors {
            Sensors::Incremental => {}
            Sensors::Ssi => bench.write(0x2100, 1, &[2]).unwrap(),
            Sensors::SsiAsSecond => bench.write(0x2100, 2, &[2]).unwrap(),
        }
        if self.personality == Personality::Lift {
            bench.write(0x2305, 0, &[3]).unwrap();
            let source = if self.sensors == Sensors::SsiAsSecond { self.channel_of_lift() } else { 1 };
            bench.write(0x2301, 1, &[source]).unwrap();
        }
        if matches!(self.change.0, 0x2200..=0x2201) {
            bench.write(0x2203, 0, b"cali").unwrap();
        }
        if self.is_filtered() {
            self.step(&mut bench);
        } else {
            (0..20).for_each(|_| sample(&mut bench));
        }
        bench
    }

    /// Whether the change is one of the filter, which makes a difference while the filter follows a step.
    fn is_filtered(&self) -> bool {
        matches!(self.change.0, 0x2310 | 0x61A0..=0x61A1 | 0x69A0..=0x69A1)
    }

    /// A step of the inputs that a slow filter has hardly followed. The load has a slow filter by default.
    fn step(&self, bench: &mut Bench) {
        if self.personality != Personality::Lift {
            let (kind, sub) = (self.change.0 & !1, self.change.1);
            bench.write(kind, sub, &[1]).unwrap();
            bench.write(kind + 1, sub, &[255]).unwrap();
        }
        (0..20).for_each(|_| bench.sample(&raw(100_000.0, 280.0)));
        (0..OLDER).for_each(|_| sample(bench));
    }

    /// The channel that the unit of the lift takes: that of the change.
    fn channel_of_lift(&self) -> u8 {
        if matches!(self.change.0, 0x2100..=0x2102 | 0x2104) { self.change.1 } else { 2 }
    }

    fn name(&self) -> String {
        format!("{:?}: {:X?} and {:X?}", self.personality, self.change, self.command)
    }

    fn write(bench: &mut Bench, (index, sub, bytes): &Write) -> Result<(), u32> {
        bench.write(*index, *sub, bytes)
    }

    /// The value, in samples with the new parameters.
    fn value(&self, bench: &mut Bench) -> Vec<u8> {
        (0..2 * OLDER).for_each(|_| sample(bench));
        bench.read(self.value.0, self.value.1).unwrap()
    }

    /// After the command: whether the value is the right one.
    fn holds(&self, bench: &mut Bench, id: u8) -> bool {
        let value = self.value(bench);
        match &self.right {
            Right::Zero => f32::from_le_bytes(value.try_into().unwrap()).abs() < 0.1,
            Right::Value(expected) => value[..expected.len()] == expected[..],
            Right::Kept => {
                let mut other = self.booted(id);
                Case::write(&mut other, &self.change).unwrap();
                value == self.value(&mut other)
            }
        }
    }
}

#[test]
fn a_command_right_after_another_parameter_is_refused_or_right() {
    let mut wrong = vec![];
    for case in cases() {
        for (id, samples) in [(1, 0), (16, 1), (127, 2)] {
            let (mut bench, name) = (case.booted(id), case.name());
            assert_eq!(Case::write(&mut bench, &case.change), Ok(()), "{name}");
            (0..samples).for_each(|_| sample(&mut bench));
            match Case::write(&mut bench, &case.command) {
                Err(DEVICE_STATE) => {}
                Ok(()) if case.holds(&mut bench, id) => {}
                result => wrong.push(format!("{name} after {samples} samples: {result:X?}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_command_after_a_sample_with_the_new_parameter_is_right() {
    for case in cases() {
        let (mut bench, name) = (case.booted(5), case.name());
        assert_eq!(Case::write(&mut bench, &case.change), Ok(()), "{name}");
        (0..2 * OLDER).for_each(|_| sample(&mut bench));
        assert_eq!(Case::write(&mut bench, &case.command), Ok(()), "{name}");
        assert!(case.holds(&mut bench, 5), "{name}");
    }
}
