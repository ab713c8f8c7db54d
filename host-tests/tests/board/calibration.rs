//! The program that compares the model of cycles with a chip, on the emulated board: what it prints there, beside what is published.

use canbus::Time;
use emulator::Estimate;

use crate::hal_examples::{run, start_program};

/// What the program repeats, and the cycles of each that are published, at least and at most.
///
/// By the Cortex-M4 technical reference manual, tables 3-1 and 7-1. On the peripheral buses: two cycles of the bus for a transfer (AMBA 3 APB,
/// 2.1), at most as many again for a transfer that was stored before and one for the edge, and two for the bus matrix, at
/// PCLK1 = HCLK / 4 and PCLK2 = HCLK / 2. In a row that is longer than the caches, a line of 128 bits is waited for (RM0390, 3.4).
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

/// What the ends of the measured code come to, for each instruction.
const ENDS: f64 = 0.1;

/// The cycles of each line as the program prints them.
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
fn what_the_model_says_beside_what_is_published() {
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
