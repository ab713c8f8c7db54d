//! Faults of the chip: a clock, the converter, an interrupt, the flash, the power. The node recovers, or reports the
//! loss.

use canbus::Time;
use chip::Peripherals;
use chip::plant::{Fault, FaultKind};
use sim::world::World;

use crate::support::{Master, SECOND, comes_back, run, running, world};

/// Timer 2, the time base: its counter (RM0390, 17.4.10) and its interrupt.
const TIM2_CNT: u32 = 0x4000_0024;
pub(crate) const TIM2: u32 = 28;
/// The interrupts of the services and of the sampling.
const CAN1_SCE: u32 = 22;
const DMA2_STREAM0: u32 = 56;
/// The application's vector table (memory.x), an endless loop, and an undefined instruction.
const VECTORS: u32 = 0x0802_0200;
pub(crate) const BRANCH_TO_ITSELF: [u8; 2] = [0xFE, 0xE7];
/// UDF #0.
const UNDEFINED: [u8; 2] = [0x00, 0xDE];
/// EMCY code for an unexpected reset (object 3000h:3, bit 6).
const UNEXPECTED_RESET: u16 = 0x6101;
/// RAM of the chip (RM0390, 2.3.1).
const RAM: u32 = 0x2000_0000;
const RAM_SIZE: usize = 128 * 1024;
/// Clock enables of APB2 with the bit of the converter: without a clock the converter ignores writes (RM0390, 6.3.14).
const RCC_APB2ENR: u32 = 0x4002_3844;
const ADC1EN: u32 = 1 << 8;
/// The interrupt of the task that stores parameters.
const SDIO: u32 = 49;
/// The parameter pages (memory.x).
const PAGE: u32 = 0x0800_8000;
const PAGE_SIZE: u32 = 0x4000;
/// SDO abort code for a failure of the hardware (CiA 301, table 22).
const HARDWARE: u32 = 0x0606_0000;

pub(crate) fn poke(world: &mut World, register: u32, value: u32) {
    let now = world.machine(0).now();
    world.machine(0).peripherals_mut().write(register, 4, value, now).unwrap();
}

pub(crate) fn peek(world: &mut World, register: u32) -> u32 {
    let now = world.machine(0).now();
    world.machine(0).peripherals_mut().read(register, 4, now).unwrap()
}

/// No restart of the conversions helps.
#[test]
fn a_dead_converter_is_ended_by_the_watchdog() {
    let mut world = running();
    let clocks = peek(&mut world, RCC_APB2ENR);
    // The firmware accesses the converter without its clock, which breaks a rule.
    world.enforce_rules(false);
    poke(&mut world, RCC_APB2ENR, clocks & !ADC1EN);
    let log = comes_back(&mut world);
    assert!(log.contains("reset by independent watchdog"), "{log}");
}

/// A handler that never ends, like that of an interrupt that cannot be cleared: all lower priorities starve.
#[test]
fn an_interrupt_without_end_is_ended_by_the_watchdog() {
    let mut world = running();
    run_broken(&mut world, TIM2, BRANCH_TO_ITSELF);
    let after = run(&mut world, SECOND * 4);
    let log: Vec<String> = world.take_log().into_iter().map(|line| line.text).collect();
    assert!(log.concat().contains("reset by independent watchdog"), "{log:?}");
    assert!(after.nodes[0].heard.boot_ups == 2 && after.nodes[0].heard.heartbeats > 1, "{after}");
}

/// The task of the lowest priority hangs: all other tasks go on, but parameters could no longer be stored.
#[test]
fn a_task_that_stores_for_ever_is_ended_by_the_watchdog() {
    let mut world = running();
    run_broken(&mut world, SDIO, BRANCH_TO_ITSELF);
    let log = comes_back(&mut world);
    assert!(log.contains("reset by independent watchdog"), "{log}");
}

/// Each task with an interrupt of its own meets an undefined instruction: the crash record has the address.
#[test]
fn a_fault_in_a_task_ends_in_a_recorded_reset() {
    for irq in [TIM2, CAN1_SCE, DMA2_STREAM0] {
        let mut world = running();
        let handler = run_broken(&mut world, irq, UNDEFINED);
        let log = comes_back(&mut world);
        assert!(log.contains(&format!("fault at {handler:#010x}")), "interrupt {irq}: {log}");
        assert_eq!(world.traffic().node(1).last_emcy, Some(UNEXPECTED_RESET), "interrupt {irq}: {log}");
    }
}

/// Replaces the first instruction of a handler until a reset follows. Returns the address.
pub(crate) fn run_broken(world: &mut World, irq: u32, instruction: [u8; 2]) -> u32 {
    let mut vector = [0; 4];
    world.machine(0).read(VECTORS + 4 * (16 + irq), &mut vector).unwrap();
    let handler = u32::from_le_bytes(vector) & !1;
    let mut code = [0; 2];
    world.machine(0).read(handler, &mut code).unwrap();
    world.machine(0).write(handler, &instruction).unwrap();
    // The bootloader does not start a changed application, so the code must be restored before its CRC is computed.
    let reset = (0..1000).find(|_| {
        world.run_until(world.now() + Time::from_millis(1));
        !world.machine(0).incidents().is_empty()
    });
    world.machine(0).write(handler, &code).unwrap();
    assert!(reset.is_some(), "nobody has ended it");
    handler
}

/// Stops the clock on OSC_IN, from now until `until`.
fn stop_crystal(world: &mut World, until: Time) {
    let fault = Fault { kind: FaultKind::NoCrystal, from: world.now(), until: world.now() + until };
    let now = world.now();
    world.machine(0).peripherals_mut().plant_mut(now).add_fault(fault);
}

/// Without the crystal the node never joins the bus, and the watchdog restarts it again and again.
#[test]
fn a_node_without_its_clock_is_silent_and_starts_with_the_clock() {
    let mut world = running();
    stop_crystal(&mut world, SECOND * 5);
    let now = world.now();
    world.machine(0).power_on(now);
    let silent = run(&mut world, SECOND * 5).nodes[0].clone();
    assert_eq!(silent.heard.boot_ups, 1, "the one before");
    assert!(!silent.incidents.is_empty(), "the watchdog has reset it");
    let after = run(&mut world, SECOND * 5);
    assert_eq!(after.nodes[0].heard.boot_ups, 2, "{after}");
    assert!(after.nodes[0].heard.heartbeats > silent.heard.heartbeats, "{after}");
}

/// The clock security system reports the failure at once: clocked by HSI, the node would destroy the frames of other
/// nodes.
#[test]
fn a_node_whose_clock_fails_leaves_the_bus_at_once() {
    let mut world = world("--bitrate 1000 --load 50 --node 1:pressure --node 2:pressure");
    let before = run(&mut world, SECOND);
    stop_crystal(&mut world, SECOND * 3);
    let silent = run(&mut world, SECOND * 3);
    // Until the node has left, its controller runs with the wrong clock, which costs other nodes one frame at most.
    assert!(silent.bus.errors <= before.bus.errors + 1, "{silent}");
    let after = run(&mut world, SECOND * 5);
    let log: Vec<String> = world.take_log().into_iter().map(|line| line.text).collect();
    assert!(log.concat().contains("the clock on OSC_IN failed"), "{log:?}");
    assert_eq!(after.nodes[0].heard.boot_ups, 2, "{after}");
    assert!(after.nodes[0].heard.heartbeats > silent.nodes[0].heard.heartbeats, "{after}");
    assert_eq!(world.traffic().node(1).last_emcy, Some(UNEXPECTED_RESET));
}

/// The 32-bit counter of microseconds reaches its half and its end, as happens every 71 minutes.
#[test]
fn timers_continue_when_the_counter_of_the_time_base_wraps() {
    let mut world = running();
    let master = Master::join(&mut world);
    for before in [0x7FFF_0000, 0xFFFF_0000] {
        poke(&mut world, TIM2_CNT, before);
        // The test moves the counter past the deadlines that were set, which time never does: two frames make the node
        // set them again.
        master.send(&mut world, 0x000, &[0x80, 1]);
        master.send(&mut world, 0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
        run(&mut world, SECOND);
        let before = run(&mut world, SECOND).nodes[0].clone();
        let after = run(&mut world, SECOND * 5).nodes[0].clone();
        assert_eq!(after.heard.heartbeats - before.heard.heartbeats, 5, "one a second");
        assert_eq!(after.sampling.samples - before.sampling.samples, 5000);
        assert!(after.incidents.is_empty() && after.heard.boot_ups == 1, "{:?}", after.incidents);
    }
}

/// The power fails in each phase of a save: afterwards the node has either the old or the new values.
#[test]
fn a_save_that_the_power_cuts_is_made_or_not_made() {
    cut_saves(|world| {
        let now = world.now();
        world.machine(0).power_on(now);
    });
}

/// The supply fails so briefly that RAM keeps its content, including the note for the bootloader and the crash record.
#[test]
fn a_save_that_a_brown_out_cuts_is_made_or_not_made() {
    cut_saves(|world| {
        let mut kept = vec![0; RAM_SIZE];
        let now = world.now();
        let machine = world.machine(0);
        machine.read(RAM, &mut kept).unwrap();
        machine.power_on(now);
        machine.write(RAM, &kept).unwrap();
    });
}

/// Cuts one save after the other, each at a later operation of the flash, and restarts the node with `restart`.
fn cut_saves(restart: impl Fn(&mut World)) {
    const OLD: [u8; 4] = [1, 2, 3, 4];
    const NEW: [u8; 4] = [5, 6, 7, 8];
    /// Only every fifth operation; the tests of the store itself cut every operation.
    const STRIDE: u64 = 5;
    let mut found = [0, 0];
    let mut operation = 0;
    loop {
        let mut world = world("--bitrate 1000");
        let master = Master::join(&mut world);
        world.run_until(SECOND);
        store(&mut world, &master, OLD);
        let flash = world.machine(0).peripherals_mut().flash_mut();
        flash.cut_power_at_operation(operation);
        write(&mut world, &master, NEW);
        master.send(&mut world, 0x601, &SAVE);
        world.run_until(world.now() + Time::from_millis(100));
        let is_saved = !master.heard(&mut world, 0x581).is_empty();
        restart(&mut world);
        world.run_until(world.now() + SECOND);
        let answer = master.ask(&mut world, 1, &[0x40, 0, 0x40, 1, 0, 0, 0, 0]);
        match &answer[4..] {
            value if value == OLD => found[0] += 1,
            value if value == NEW => found[1] += 1,
            other => panic!("cut at operation {operation}: {other:?}"),
        }
        if is_saved {
            break;
        }
        operation += STRIDE;
    }
    println!(
        "cut at {} operations of a save: {found:?} with what was saved before and now",
        operation / STRIDE
    );
    assert!(found[0] > 8 && found[1] > 0, "{found:?}");
}

/// 1010h:1.
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];

fn write(world: &mut World, master: &Master, [a, b, c, d]: [u8; 4]) {
    assert_eq!(master.ask(world, 1, &[0x23, 0, 0x40, 1, a, b, c, d])[0], 0x60);
}

fn store(world: &mut World, master: &Master, value: [u8; 4]) {
    write(world, master, value);
    assert_eq!(master.ask(world, 1, &SAVE)[0], 0x60);
}

/// Flash cells that cannot be programmed: the client gets an error, and the earlier saved values stay.
#[test]
fn a_flash_that_does_not_program_aborts_the_save() {
    let mut world = world("--bitrate 1000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    store(&mut world, &master, [1, 2, 3, 4]);
    for page in [PAGE, PAGE + PAGE_SIZE] {
        let mut bytes = vec![0; PAGE_SIZE as usize];
        let machine = world.machine(0);
        machine.read(page, &mut bytes).unwrap();
        let used = bytes.iter().rposition(|&byte| byte != 0xFF).map_or(0, |last| last / 4 * 4 + 4);
        // Bits that stay 0 even after an erase: the first words after the last save.
        bytes[used + 8..used + 64].fill(0xA5);
        machine.write(page, &bytes).unwrap();
    }
    write(&mut world, &master, [5, 6, 7, 8]);
    let answer = master.ask(&mut world, 1, &SAVE);
    let code = u32::from_le_bytes(answer[4..].try_into().unwrap());
    assert_eq!((answer[0], code), (0x80, HARDWARE), "{answer:02x?}");
    let now = world.now();
    world.machine(0).power_on(now);
    world.run_until(now + SECOND * 2);
    assert_eq!(master.ask(&mut world, 1, &[0x40, 0, 0x40, 1, 0, 0, 0, 0])[4..], [1, 2, 3, 4]);
}
