//! Faults that must never happen, provoked: the node recovers and reports the cause.

use crate::chip_faults::{peek, poke};
use crate::support::{Master, SECOND, comes_back, read, run, running};
use canbus::Time;
use host_tests::watch::expects;
use monitor::Rule;

/// The first word of RAM, below which the stack must not grow, and an address that no image uses.
const RAM: u32 = 0x2000_0000;
const UNUSED: u32 = RAM + 0x1_0000;
/// The start of the area that the bootloader checks: the application's vector table (memory.x).
const APPLICATION: u32 = 0x0802_0200;
const VECTORS: usize = 512;
/// Control register 1 of the timer that starts the conversions.
const TIM3_CR1: u32 = 0x4000_0400;
/// Clock enables of APB1 with the bit of the timer that starts the conversions: without a clock the timer ignores
/// writes (RM0390, 6.3.13).
const RCC_APB1ENR: u32 = 0x4002_3840;
const TIM3EN: u32 = 1 << 1;
/// An interrupt that the node does not use, its bit in word 1 of the NVIC, and that word of the set-enable and
/// set-pending registers (RM0390, table 38; PM0214, 4.3).
const CAN2_TX: u32 = 63;
const CAN2_TX_BIT: u32 = 1 << (CAN2_TX - 32);
const NVIC_ISER1: u32 = 0xE000_E104;
const NVIC_ISPR1: u32 = 0xE000_E204;
/// EMCY code for an unexpected reset (object 3000h:3, bit 6).
const UNEXPECTED_RESET: u16 = 0x6101;
/// Stack pointer and program counter.
const SP: u8 = 13;
const PC: u8 = 15;

#[test]
fn a_stack_overflow_ends_in_a_recorded_reset() {
    let mut world = running();
    world.machine(0).set_register(SP, RAM + 8);
    let log = comes_back(&mut world);
    assert_eq!(world.traffic().node(1).last_emcy, Some(UNEXPECTED_RESET), "{log}");
    assert!(log.contains("stack overflow"), "{log}");
    assert!(log.contains("reset by software"), "{log}");
}

#[test]
fn a_wild_jump_ends_in_a_recorded_reset_with_its_address() {
    let mut world = running();
    world.machine(0).set_register(PC, 0x3000_0000);
    let log = comes_back(&mut world);
    assert!(log.contains("fault at 0x30000000"), "{log}");
}

/// The program enables an interrupt without a handler, and the interrupt comes.
#[test]
fn an_interrupt_without_a_handler_ends_in_a_recorded_reset() {
    /// STR r2, \[r0\]; STR r2, \[r1\]; B to itself.
    const CODE: [u8; 6] = [0x02, 0x60, 0x0A, 0x60, 0xFE, 0xE7];
    let mut world = running();
    let machine = world.machine(0);
    machine.write(UNUSED, &CODE).unwrap();
    for (register, value) in [(0, NVIC_ISER1), (1, NVIC_ISPR1), (2, CAN2_TX_BIT), (PC, UNUSED)] {
        machine.set_register(register, value);
    }
    let log = comes_back(&mut world);
    assert!(log.contains(&format!("interrupt {CAN2_TX},")), "{log}");
    assert_eq!(world.traffic().node(1).last_emcy, Some(UNEXPECTED_RESET), "{log}");
}

#[test]
fn a_crash_is_reported_once() {
    let mut world = running();
    world.machine(0).set_register(PC, 0x3000_0000);
    comes_back(&mut world);
    let machine = world.machine(0);
    machine.power_off();
    machine.power_on(Time::ZERO);
    let log = comes_back(&mut world);
    assert!(!log.contains("the last run"), "{log}");
    assert!(log.contains("reset by power on"), "{log}");
}

/// The timer stops and can no longer be written.
#[test]
fn the_watchdog_restarts_a_node_that_no_longer_samples() {
    let mut world = running();
    let clocks = peek(&mut world, RCC_APB1ENR);
    // The firmware accesses the timer without its clock, which breaks a rule.
    world.enforce_rules(false);
    poke(&mut world, TIM3_CR1, 0);
    poke(&mut world, RCC_APB1ENR, clocks & !TIM3EN);
    let log = comes_back(&mut world);
    assert!(log.contains("reset by independent watchdog"), "{log}");
    assert_eq!(world.traffic().node(1).last_emcy, Some(UNEXPECTED_RESET), "{log}");
}

/// Every frame is destroyed for a while: the node becomes bus-off, recovers without a reset and reports the bus-off.
#[test]
fn a_node_recovers_from_bus_off() {
    let _expected = expects([Rule::HeartbeatLate]);
    let mut world = running();
    world.bus().faults.noise(1, 1.0);
    world.run_until(SECOND * 2);
    world.bus().faults.quiet();
    let silent = world.traffic().node(1);
    let after = run(&mut world, SECOND * 3);
    let node = &after.nodes[0];
    assert!(node.heard.heartbeats > silent.heartbeats, "{after}");
    assert!(node.heard.emcys > silent.emcys, "{after}");
    assert_eq!(node.heard.boot_ups, silent.boot_ups, "{after}");
    assert!(node.incidents.is_empty(), "{after}");
}

/// On a line that destroys every frame, the node tries less and less often: each wait is twice as long, up to 3.2 s.
#[test]
fn a_node_on_a_broken_line_tries_less_and_less_often() {
    let _expected = expects([Rule::HeartbeatLate]);
    let mut world = running();
    world.bus().faults.noise(1, 1.0);
    let first = run(&mut world, SECOND).bus.errors;
    let before = run(&mut world, SECOND * 19).bus.errors;
    let last = run(&mut world, SECOND * 10).bus.errors - before;
    println!("{first} error frames in the first second, {last} in ten seconds later on");
    // Each try ends with bus-off, after 32 transmit errors.
    assert!(first > 64 && last <= 4 * 33, "{first}, {last}");
    world.bus().faults.quiet();
    let after = run(&mut world, SECOND * 6);
    assert_eq!(after.nodes[0].heard.last_emcy, Some(0), "it is back and well: {after}");
}

/// Without an application the bootloader keeps running instead of jumping into erased flash.
#[test]
fn the_bootloader_does_not_start_an_erased_application() {
    let mut world = running();
    let boot_ups = world.traffic().node(1).boot_ups;
    let machine = world.machine(0);
    machine.write(APPLICATION, &[0xFF; VECTORS]).unwrap();
    machine.power_off();
    machine.power_on(Time::ZERO);
    let after = run(&mut world, SECOND);
    assert_eq!(after.nodes[0].heard.boot_ups, boot_ups + 1);
    assert!(after.nodes[0].incidents.is_empty(), "{after}");
    // The bootloader, not the application, has booted with the node-ID of the board.
    let master = Master::join(&mut world);
    assert_eq!(read(&mut world, &master, (0x1000, 0)), u32::from_be_bytes(*b"BOOT"));
}
