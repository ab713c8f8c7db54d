//! The program that compares the model of cycles with a chip, on the emulated board: what it prints there, beside what is published.

use canbus::Time;

use crate::hal_examples::{run, start_program};

/// What the program repeats; the cycles of each that are published, at least and at most; and whether the model keeps to them.
///
/// By the Cortex-M4 technical reference manual, tables 3-1 and 7-1. On the peripheral buses: two cycles of the bus for a transfer (AMBA 3 APB,
/// 2.1), at most as many again for a transfer that was stored before and one for the edge, and two for the bus matrix, at
/// PCLK1 = HCLK / 4 and PCLK2 = HCLK / 2. In a row that is longer than the caches, a line of 128 bits is waited for (RM0390, 3.4).
const LINES: [(&str, f64, f64, bool); 14] = [
    ("ADDS", 1.0, 1.0, true),
    ("LDR, one after the other", 1.0, 2.0, true),
    ("STR", 1.0, 2.0, true),
    // With its CMP. The model takes each branch for one that is taken half of the time.
    ("branch not taken", 2.0, 2.0, false),
    ("branch taken", 2.0, 4.0, true),
    ("UDIV of 1", 2.0, 12.0, true),
    ("UDIV of FFFFFFFFh", 2.0, 12.0, true),
    ("VADD, each for itself", 1.0, 1.0, true),
    // The model knows of no instruction that waits for the result of another one.
    ("VADD of the one before", 2.0, 2.0, false),
    ("VDIV", 14.0, 14.0, true),
    // The model knows of no bridge between the buses.
    ("LDR on APB1", 8.0, 22.0, false),
    ("LDR on APB2", 4.0, 12.0, false),
    ("LDR on AHB1", 1.0, 4.0, true),
    ("4 KiB of NOP", 1.0, 1.63, true),
];

/// What the ends of the measured code come to, for each instruction.
const ENDS: f64 = 0.03;

#[test]
fn what_the_model_says_beside_what_is_published() {
    let mut machine = start_program("calibrate", None);
    machine.attach_debugger();
    run(&mut machine, Time::from_millis(100), |_| ());
    assert_eq!(machine.incidents(), []);
    let printed = machine.take_printed();
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines.len(), LINES.len(), "{printed}");
    println!("| cycles of | published | modelled |\n|---|---|---|");
    for (line, (name, least, most, holds)) in lines.iter().zip(LINES) {
        let (said, figures) = line.split_once(": ").unwrap();
        assert_eq!(said, name);
        let (count, took) = figures.split_once(" took ").unwrap();
        let each = took.parse::<f64>().unwrap() / count.parse::<f64>().unwrap();
        println!("| {name} | {least} to {most} | {each:.1}{} |", if holds { "" } else { ", outside" });
        assert_eq!((least - ENDS..=most + ENDS).contains(&each), holds, "{line}");
    }
}
