//! The program that compares the cycle model with a chip, run on the emulated board: its output is compared with the
//! published figures.

use canbus::Time;
use emulator::Estimate;

use crate::hal_examples::{run, start_program};

/// The instructions that the program repeats, and the published least and most cycles of each.
///
/// The source is the Cortex-M4 technical reference manual, tables 3-1 and 7-1. On the peripheral buses a transfer takes
/// two cycles of the bus (AMBA 3 APB, 2.1), at most as many again for a previous buffered transfer, one for the edge,
/// and two for the bus matrix, at PCLK1 = HCLK / 4 and PCLK2 = HCLK / 2. Straight-line code that is longer than the
/// caches waits for each line of 128 bits (RM0390, 3.4).
const LINES: [(&str, f64, f64); 16] = [
    ("ADDS", 1.0, 1.0),
    ("LDR, one after the other", 1.0, 2.0),
    ("STR", 1.0, 2.0),
    ("branch not taken", 2.0, 2.0),
    ("branch taken", 2.0, 4.0),
    ("UDIV of 1", 2.0, 12.0),
    ("UDIV of FFFFFFFFh", 2.0, 12.0),
    ("VADD, each for itself", 1.0, 1.0),
    ("VADD of the one before", 2.0, 2.0),
    ("VDIV", 14.0, 14.0),
    ("LDR on APB1", 8.0, 22.0),
    ("LDR on APB2", 4.0, 12.0),
    ("LDR on AHB1", 1.0, 4.0),
    ("STR on APB1", 8.0, 22.0),
    ("STR on APB2", 4.0, 12.0),
    ("4 KiB of NOP", 1.0, 1.63),
];

/// Tolerance per instruction for the code around the measured one, in cycles.
const ENDS: f64 = 0.1;

/// The cycles of each line in the program's output.
fn measured(estimate: Estimate) -> Vec<f64> {
    let mut machine = start_program("calibrate", None);
    machine.set_estimate(estimate).unwrap();
    machine.attach_debugger();
    run(&mut machine, Time::from_millis(100), |_| ());
    assert_eq!(machine.incidents(), []);
    let printed = machine.take_printed();
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines.len(), LINES.len(), "{printed}");
    lines.iter().zip(LINES).map(|(line, (name, ..))| cycles(line, name)).collect()
}

fn cycles(line: &str, name: &str) -> f64 {
    let (said, figures) = line.split_once(": ").unwrap();
    assert_eq!(said, name);
    let (count, took) = figures.split_once(" took ").unwrap();
    took.parse::<f64>().unwrap() / count.parse::<f64>().unwrap()
}

#[test]
fn the_cycles_of_the_model_are_within_the_published_range() {
    let [best, modelled, worst] = [Estimate::Best, Estimate::Modelled, Estimate::Worst].map(measured);
    println!("| cycles of | published | best | modelled | worst |\n|---|---|---|---|---|");
    for (place, (name, least, most)) in LINES.into_iter().enumerate() {
        let (best, modelled, worst) = (best[place], modelled[place], worst[place]);
        println!("| {name} | {least} to {most} | {best:.1} | {modelled:.1} | {worst:.1} |");
        assert!(best <= least + ENDS, "{name}: best {best}");
        assert!((least - ENDS..=most + ENDS).contains(&modelled), "{name}: modelled {modelled}");
        assert!(worst >= most - ENDS, "{name}: worst {worst}");
    }
}
