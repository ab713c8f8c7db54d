//! Examples of the stm32f4xx-hal package, built from its published source, behave on the emulated board as their
//! comments promise. Neither the examples nor the board were written for each other.

use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Machine, Model};

use crate::support::images;

/// Period at which outputs are sampled.
const STEP: Time = Time::from_millis(1);

/// A chip that runs an example, on a board with a crystal of `hse` hertz.
fn start(example: &str, hse: Option<u64>) -> Machine<Stm32f4> {
    start_program(&format!("hal-{example}"), hse)
}

/// A chip that runs a program without the bootloader.
pub(crate) fn start_program(name: &str, hse: Option<u64>) -> Machine<Stm32f4> {
    let elf = std::fs::read(images().join(name)).unwrap();
    let chip = Stm32f4::new(Variant::F446, Board { hse, hse_is_clock: false, ..Board::default() });
    let mut machine = Machine::new(Model::stm32f4(Variant::F446.flash_size()), chip).unwrap();
    machine.load_elf(&elf).unwrap();
    machine.power_on(Time::ZERO);
    machine
}

/// Runs until `end` and calls `look` after each step.
pub(crate) fn run(machine: &mut Machine<Stm32f4>, end: Time, mut look: impl FnMut(&mut Machine<Stm32f4>)) {
    while machine.now() < end {
        let until = machine.now() + STEP;
        machine.run_until(until);
        look(machine);
    }
}

/// The virtual time in milliseconds.
fn now(machine: &Machine<Stm32f4>) -> u64 {
    machine.now().as_micros() / 1000
}

/// The edges of an output until `end`: the time in milliseconds and the new level.
fn edges(machine: &mut Machine<Stm32f4>, (port, pin): (char, u32), end: Time) -> Vec<(u64, bool)> {
    let mut edges = Vec::new();
    let mut level = None;
    run(machine, end, |machine| {
        let found = machine.peripherals().output(port, pin);
        if found != level {
            edges.extend(found.map(|level| (now(machine), level)));
            level = found;
        }
    });
    edges
}

/// The times between edges, from the first rising edge on.
fn spans_from_on(edges: &[(u64, bool)]) -> Vec<(bool, u64)> {
    let on = edges.iter().position(|(_, level)| *level).unwrap_or(edges.len());
    spans(&edges[on..])
}

/// The times between edges in milliseconds, each with the level in that time.
fn spans(edges: &[(u64, bool)]) -> Vec<(bool, u64)> {
    edges.windows(2).map(|pair| (pair[0].1, pair[1].0 - pair[0].0)).collect()
}

fn holds(spans: &[(bool, u64)], expected: &[(bool, u64)]) {
    assert!(spans.len() >= expected.len(), "{spans:?}");
    for ((level, span), (expected_level, expected)) in spans.iter().zip(expected) {
        assert_eq!(level, expected_level, "{spans:?}");
        assert!(span.abs_diff(*expected) <= 2, "{spans:?}");
    }
}

fn is_clean(machine: &Machine<Stm32f4>) {
    assert_eq!(machine.incidents(), []);
    assert_eq!(machine.peripherals().unmodelled(), []);
}

#[test]
#[ignore = "the examples are built by `cargo xtask test --thorough`"]
fn the_led_of_blinky_timer_irq_changes_with_each_second_of_the_timer() {
    let mut machine = start("blinky-timer-irq", None);
    let seen = edges(&mut machine, ('A', 5), Time::from_millis(4100));
    assert_eq!(seen.first().map(|(at, level)| (*at <= 1, *level)), Some((true, true)), "{seen:?}");
    holds(&spans(&seen), &[(true, 1000), (false, 1000), (true, 1000)]);
    is_clean(&machine);
}

#[test]
#[ignore = "the examples are built by `cargo xtask test --thorough`"]
fn the_led_of_delay_timer_blinky_is_on_for_one_second_and_off_for_three() {
    let mut machine = start("delay-timer-blinky", Some(25_000_000));
    let seen = edges(&mut machine, ('C', 13), Time::from_millis(5200));
    holds(&spans_from_on(&seen), &[(true, 1000), (false, 3000)]);
    is_clean(&machine);
}

#[test]
#[ignore = "the examples are built by `cargo xtask test --thorough`"]
fn the_leds_of_dwt_blinky_take_turns_of_a_second_by_the_cycle_counter() {
    let mut machine = start("dwt-blinky", None);
    let seen = edges(&mut machine, ('G', 13), Time::from_millis(3200));
    holds(&spans_from_on(&seen), &[(true, 1000), (false, 1000)]);
    is_clean(&machine);
}

#[test]
#[ignore = "the examples are built by `cargo xtask test --thorough`"]
fn timer_syst_prints_each_time_that_its_timer_expires_and_never_its_last_line() {
    let mut machine = start("timer-syst", None);
    machine.attach_debugger();
    let mut printed = String::new();
    let mut when = Vec::new();
    run(&mut machine, Time::from_millis(400), |machine| {
        let new = machine.take_printed();
        when.extend(new.lines().map(|_| now(machine)));
        printed += &new;
    });
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(
        lines,
        [
            "hello!",
            "timer expired 1",
            "timer expired 2",
            "timer expired 3",
            "ehy, you cannot cancel a timer two times!"
        ]
    );
    let spans: Vec<u64> = when.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(spans.iter().zip([42, 42, 42]).all(|(span, expected)| span.abs_diff(expected) <= 1), "{when:?}");
    is_clean(&machine);
}
