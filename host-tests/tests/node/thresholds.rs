//! Change thresholds of a TPDO of type 255 (6133h, 2112h): the difference from the value that this TPDO has sent last.

use canopen::Frame;
use host_tests::bench::{Bench, raw};
use node::Personality;

/// A value with a threshold, and the TPDO that carries it at its begin.
struct Case {
    personality: Personality,
    threshold: (u16, u8),
    /// The threshold of 400 steps.
    width: [u8; 4],
    /// The number of the TPDO, from 0.
    tpdo: u16,
    /// Sets the value to a number of steps of 1 mbar, or of the encoder.
    set: fn(&mut Bench, u16),
    /// The steps in a frame.
    steps: fn([u8; 4]) -> f64,
}

fn press(bench: &mut Bench, steps: u16) {
    bench.sample(&raw(f64::from(steps) * 100.0, 298.15));
}

fn turn(bench: &mut Bench, steps: u16) {
    bench.encoder.counter = steps;
    bench.sample(&raw(0.0, 298.15));
}

fn pressure(personality: Personality, index: u16, tpdo: u16) -> Case {
    let millibar = |bar| f64::from(f32::from_le_bytes(bar)) * 1000.0;
    Case {
        personality,
        threshold: (index, 1),
        width: 0.4_f32.to_le_bytes(),
        tpdo,
        set: press,
        steps: millibar,
    }
}

fn position(personality: Personality) -> Case {
    let steps = |position| f64::from(u32::from_le_bytes(position));
    Case { personality, threshold: (0x2112, 1), width: 400_u32.to_le_bytes(), tpdo: 0, set: turn, steps }
}

fn cases() -> [Case; 4] {
    [
        pressure(Personality::Pressure, 0x6133, 0),
        pressure(Personality::Combined, 0x6933, 2),
        position(Personality::Encoder),
        position(Personality::Combined),
    ]
}

impl Case {
    /// A node with the threshold and a TPDO of type 255 without an event timer, in Pre-operational at 3000 steps. The
    /// temperature does not change.
    fn booted(&self, id: u8) -> Bench {
        let mut bench = Bench::booted_at(self.personality, id);
        if matches!(self.personality, Personality::Encoder | Personality::Combined) {
            bench.write(0x2104, 1, &[0; 4]).unwrap();
        }
        bench.write(0x1800 + self.tpdo, 5, &[0, 0]).unwrap();
        bench.write(0x1800 + self.tpdo, 2, &[255]).unwrap();
        bench.write(self.threshold.0, self.threshold.1, &self.width).unwrap();
        // The encoder counts from its first reading on.
        for steps in [0, 3000] {
            (self.set)(&mut bench, steps);
        }
        bench.take();
        bench
    }

    /// The steps in the frames of the TPDO since the last call, to the nearest 50.
    fn sent(&self, bench: &mut Bench) -> Vec<u32> {
        let id = 0x180 + (self.tpdo << 8) + bench.id();
        let frames = bench.take().into_iter().filter(|(sent, _)| *sent == id);
        let steps = frames.map(|(_, data)| (self.steps)(data[..4].try_into().unwrap()));
        steps.map(|steps| (steps / 50.0).round() as u32 * 50).collect()
    }
}

#[test]
fn the_value_on_entering_operational_is_the_last_one_sent() {
    for case in cases() {
        for id in [1, 16, 127] {
            let mut bench = case.booted(id);
            (case.set)(&mut bench, 3300);
            bench.nmt(1);
            assert_eq!(case.sent(&mut bench), [3300], "{:?} {id}", case.personality);
            for steps in [3100, 2950, 2850, 2700] {
                (case.set)(&mut bench, steps);
            }
            assert_eq!(case.sent(&mut bench), [2850], "{:?} {id}", case.personality);
        }
    }
}

/// A remote frame, or a write to a communication parameter, sends the TPDO within the threshold.
#[test]
fn a_value_that_is_sent_for_another_reason_is_the_last_one_sent() {
    for case in cases() {
        for id in [1, 16, 127] {
            let mut bench = case.booted(id);
            bench.nmt(1);
            (case.set)(&mut bench, 3300);
            assert_eq!(case.sent(&mut bench), [3000], "{:?} {id}", case.personality);
            let cob_id = u32::from_le_bytes(bench.read(0x1800 + case.tpdo, 1).unwrap().try_into().unwrap());
            bench.write(0x1800 + case.tpdo, 1, &(cob_id | 1 << 31).to_le_bytes()).unwrap();
            bench.write(0x1800 + case.tpdo, 1, &cob_id.to_le_bytes()).unwrap();
            (case.set)(&mut bench, 3300);
            assert_eq!(case.sent(&mut bench), [3300], "{:?} {id}", case.personality);
            (case.set)(&mut bench, 2950);
            (case.set)(&mut bench, 2850);
            assert_eq!(case.sent(&mut bench), [2850], "{:?} {id}", case.personality);
        }
    }
}

/// A second TPDO with the same value sends it with every SYNC. The first one keeps its own difference.
#[test]
fn each_tpdo_has_a_last_value_of_its_own() {
    for case in cases() {
        let mut bench = case.booted(5);
        bench.write(0x1800 + case.tpdo + 1, 2, &[1]).unwrap();
        bench.nmt(1);
        assert_eq!(case.sent(&mut bench), [3000], "{:?}", case.personality);
        for steps in (3000..=3700).step_by(100) {
            (case.set)(&mut bench, steps);
            bench.receive(&Frame::new(0x80, &[]).unwrap());
        }
        assert_eq!(case.sent(&mut bench), [3400], "{:?}", case.personality);
    }
}
