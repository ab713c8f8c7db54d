//! Misuse of the core: short programs, each wrong in one place. The emulator stops each as silicon does, or reports it.

#[allow(dead_code)]
mod bench;

use bench::Bare;
use canbus::Time;
use chip::Breach;
use emulator::{Estimate, Incident, Machine, Model};

const FLASH: u32 = 0x0800_0000;
/// Where the programs and their handlers begin.
const CODE: u32 = FLASH + 0x200;
const HANDLER: u32 = FLASH + 0x1C0;
const STACK: u32 = 0x2001_0000;
/// `b .`
const STOP: u16 = 0xE7FE;
/// `b` to the next instruction: the end of a block.
const NEXT: u16 = 0xE7FF;

const SCR: u32 = 0xE000_ED10;
const VTOR: u32 = 0xE000_ED08;
const CPACR: u32 = 0xE000_ED88;
const FPCCR: u32 = 0xE000_EF34;
const MPU_CTRL: u32 = 0xE000_ED94;
const MPU_RBAR: u32 = 0xE000_ED9C;
const MPU_RASR: u32 = 0xE000_EDA0;

/// MOVW and MOVT of a value (ARMv7-M, A7.7.76 and A7.7.79).
fn load(register: u16, value: u32) -> Vec<u16> {
    let half = |op: u16, half: u16| {
        let (i, imm4, imm3, imm8) = (half >> 11 & 1, half >> 12, half >> 8 & 7, half & 0xFF);
        [op | i << 10 | imm4, imm3 << 12 | register << 8 | imm8]
    };
    [half(0xF240, value as u16), half(0xF2C0, (value >> 16) as u16)].concat()
}

/// A machine with this program, handler and vectors of reset and SVC.
fn machine(parts: &[&[u16]], handler: &[u16], [stack, reset, call]: [u32; 3]) -> Machine<Bare> {
    let mut machine = Machine::new(Model::stm32f4(512 * 1024), Bare::default()).unwrap();
    let mut vectors = [HANDLER | 1; 16];
    (vectors[0], vectors[1], vectors[11]) = (stack, reset, call);
    let vectors: Vec<u8> = vectors.iter().flat_map(|word| word.to_le_bytes()).collect();
    let bytes = |code: &[u16]| code.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<u8>>();
    machine.write(FLASH, &vectors).unwrap();
    machine.write(HANDLER, &bytes(handler)).unwrap();
    machine.write(CODE, &bytes(&[parts.concat(), vec![STOP]].concat())).unwrap();
    machine.power_on(Time::ZERO);
    machine
}

fn program(parts: &[&[u16]]) -> Machine<Bare> {
    machine(parts, &[STOP], [STACK, CODE | 1, HANDLER | 1])
}

/// Runs for a millisecond; the status of the first fault and the address of its access.
fn fault(machine: &mut Machine<Bare>) -> Option<(u32, Option<u32>)> {
    machine.run_until(Time::from_millis(1));
    machine.incidents().iter().find_map(|(_, incident)| match incident {
        Incident::Fault(fault) => Some((fault.status, fault.address)),
        _ => None,
    })
}

/// Runs for a millisecond; the broken rules.
fn rules(machine: &mut Machine<Bare>) -> Vec<Breach> {
    machine.run_until(Time::from_millis(1));
    let rule = |(_, incident): &(Time, Incident)| match incident {
        Incident::Breach { rule, .. } => Some(*rule),
        _ => None,
    };
    machine.incidents().iter().filter_map(rule).collect()
}

fn word(machine: &Machine<Bare>, address: u32) -> u32 {
    let mut bytes = [0; 4];
    machine.read(address, &mut bytes).unwrap();
    u32::from_le_bytes(bytes)
}

#[test]
fn a_vector_without_the_thumb_bit_faults() {
    const INVSTATE: u32 = 1 << 17;
    // svc #0
    let mut wrong = machine(&[&[0xDF00]], &[STOP], [STACK, CODE | 1, HANDLER]);
    assert_eq!(fault(&mut wrong), Some((INVSTATE, None)));
    let mut right = machine(&[&[0xDF00]], &[STOP], [STACK, CODE | 1, HANDLER | 1]);
    assert_eq!(fault(&mut right), None);
    let mut reset = machine(&[], &[STOP], [STACK, CODE, HANDLER | 1]);
    assert_eq!(fault(&mut reset), Some((INVSTATE, None)));
}

#[test]
fn a_deep_sleep_is_reported() {
    // str r1, [r0]; wfi
    let sleep = |control: u32| program(&[&load(0, SCR), &load(1, control), &[0x6001, 0xBF30]]);
    assert!(rules(&mut sleep(0)).is_empty());
    let told = rules(&mut sleep(1 << 2));
    assert!(matches!(told[..], [Breach::NotModelled { what }] if what.contains("SLEEPDEEP")), "{told:?}");
}

#[test]
fn a_vector_table_at_a_multiple_of_128_is_reported() {
    for (address, is_right) in
        [(0x0800_4000, true), (0x0800_4200, true), (0x0800_4080, false), (0x0800_4100, false)]
    {
        let mut machine = program(&[]);
        machine.debug_write(VTOR, address).unwrap();
        let expected = if is_right { vec![] } else { vec![Breach::VectorTable { address, least: 512 }] };
        assert_eq!(rules(&mut machine), expected, "{address:08X}h");
    }
}

#[test]
fn interrupts_that_the_chip_has_not_stay_off() {
    let mut machine = program(&[]);
    machine.debug_write(0xE000_E10C, u32::MAX).unwrap();
    assert_eq!(machine.debug_read(0xE000_E10C), Some(1), "number 96 is the last one");
}

/// A machine with a region of the memory protection unit: the program stores to its second word, or loads from it.
fn protected(access: u32, exponent: u32, code: u16) -> Machine<Bare> {
    let mut machine = program(&[&load(0, 0x2000_0400), &[code]]);
    machine.debug_write(MPU_RBAR, 0x2000_0400 | 1 << 4).unwrap();
    machine.debug_write(MPU_RASR, access << 24 | (exponent - 1) << 1 | 1).unwrap();
    machine.debug_write(MPU_CTRL, 0b101).unwrap();
    machine
}

/// `str r1, [r0, #4]`, `ldr r1, [r0, #4]`
const STORE: u16 = 0x6041;
const LOAD: u16 = 0x6841;

#[test]
fn the_protection_unit_protects_data() {
    const DACCVIOL: u32 = 1 << 1;
    let denied = Some((DACCVIOL, Some(0x2000_0404)));
    for (access, code, expected, name) in [
        (0b000, STORE, denied, "a store to nobody's"),
        (0b000, LOAD, denied, "a load of nobody's"),
        (0b110, STORE, denied, "a store to what is read only"),
        (0b101, STORE, denied, "a store to what only privileged code reads"),
        (0b110, LOAD, None, "a load of what is read only"),
        (0b011, STORE, None, "a store to everybody's"),
    ] {
        assert_eq!(fault(&mut protected(access, 10, code)), expected, "{name}");
    }
}

#[test]
fn a_guard_that_is_finer_than_a_page_is_reported() {
    for (access, exponent, words) in [(0b000, 5, "less than a kilobyte"), (0b001, 10, "unprivileged")] {
        let told = rules(&mut protected(access, exponent, LOAD));
        assert!(matches!(told[..], [Breach::NotModelled { what }] if what.contains(words)), "{told:?}");
    }
}

#[test]
fn a_guard_below_the_stack_stops_the_entry_of_an_exception() {
    const MSTKERR: u32 = 1 << 4;
    // svc #0
    let mut machine = machine(&[&[0xDF00]], &[STOP], [0x2000_0810, CODE | 1, HANDLER | 1]);
    machine.debug_write(MPU_RBAR, 0x2000_0400 | 1 << 4).unwrap();
    machine.debug_write(MPU_RASR, 9 << 1 | 1).unwrap();
    machine.debug_write(MPU_CTRL, 0b101).unwrap();
    assert_eq!(fault(&mut machine), Some((MSTKERR, None)));
}

/// The thread's S0 after a handler that has used it: kept, unless FPCCR leaves the registers out of the frame.
#[test]
fn a_handler_spoils_the_registers_that_no_frame_has() {
    let kept = |control: u32| {
        let thread = [
            load(0, CPACR),
            load(1, 0x00F0_0000),
            vec![0x6001],
            load(0, FPCCR),
            load(1, control),
            // str r1, [r0]; dsb; isb
            vec![0x6001, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F],
            load(2, 0x3F80_0000),
            load(0, 0x2000_0000),
            // vmov s0, r2; svc #0; vmov r3, s0; str r3, [r0]
            vec![0xEE00, 0x2A10, 0xDF00, 0xEE10, 0x3A10, 0x6003],
        ];
        // movs r1, #0; vmov s0, r1; bx lr
        let handler = [0x2100, 0xEE00, 0x1A10, 0x4770];
        let mut machine = machine(&[&thread.concat()], &handler, [STACK, CODE | 1, HANDLER | 1]);
        assert_eq!(fault(&mut machine), None);
        word(&machine, 0x2000_0000)
    };
    assert_eq!(kept(0xC000_0000), 0x3F80_0000);
    assert_eq!(kept(0x8000_0000), 0x3F80_0000, "saved at once");
    assert_eq!(kept(0), 0, "in no frame");
}

/// LSPACT and FPCAR say that the registers of a frame are still to be saved.
#[test]
fn a_frame_with_room_for_registers_shows() {
    let thread = [
        load(0, CPACR),
        load(1, 0x00F0_0000),
        // str r1, [r0]; dsb; isb; vmov s0, r1; svc #0
        vec![0x6001, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F, 0xEE00, 0x1A10, 0xDF00],
    ];
    let mut machine = machine(&[&thread.concat()], &[STOP], [STACK, CODE | 1, HANDLER | 1]);
    assert_eq!(fault(&mut machine), None);
    assert_eq!(machine.debug_read(FPCCR), Some(0xC000_0001));
    assert_eq!(machine.debug_read(FPCCR + 4), Some(STACK - 26 * 4 + 8 * 4));
}

#[test]
fn a_half_of_the_fault_status_is_cleared_alone() {
    // A bus fault, and then a usage fault; a half-word to UFSR: strh r1, [r0]
    let code = [load(0, 0xF000_0000), vec![0x6802]].concat();
    let handler = [load(0, 0xE000_ED2A), load(1, 0xFFFF), vec![0x8001, STOP]].concat();
    let mut machine = machine(&[&code], &handler, [STACK, CODE | 1, HANDLER | 1]);
    assert_eq!(fault(&mut machine), Some((1 << 9, Some(0xF000_0000))));
    assert_eq!(machine.debug_read(0xE000_ED28), Some(1 << 9 | 1 << 15), "BFSR stays");
}

#[test]
fn the_cycle_counter_keeps_its_count_when_it_stops() {
    const DWT: u32 = 0xE000_1000;
    let mut machine = program(&[]);
    machine.debug_write(0xE000_EDFC, 1 << 24).unwrap();
    machine.debug_write(DWT + 4, 5).unwrap();
    machine.debug_write(DWT, 1).unwrap();
    machine.run_until(Time::from_micros(100));
    machine.debug_write(DWT, 0).unwrap();
    let stopped = machine.debug_read(DWT + 4).unwrap();
    machine.run_until(Time::from_micros(200));
    assert!(stopped >= 1600 && machine.debug_read(DWT + 4) == Some(stopped), "{stopped}");
}

/// A place in flash behind the program, for a constant.
const CONSTANT: u32 = 0x0804_0000;

#[test]
fn a_constant_from_before_its_programming_is_reported() {
    // ldr r1, [r0]; movs r2, #0; str r2, [r0]; ldr r1, [r0]
    let reads = |again: u16| program(&[&load(0, CONSTANT), &[0x6801, 0x2200, 0x6002, NEXT, again]]);
    let stale = Breach::StaleCache { what: "constants", address: CONSTANT };
    for (again, expected) in [(0x6801, vec![stale]), (0xBF00, vec![])] {
        let mut machine = reads(again);
        machine.set_estimate(Estimate::Worst).unwrap();
        assert_eq!(rules(&mut machine), expected, "{again:04X}h");
    }
    assert!(rules(&mut reads(0x6801)).is_empty(), "only this estimate has caches");
}

#[test]
fn code_from_before_its_programming_is_reported() {
    // blx r0, to `bx lr`; strh r2, [r1]; blx r0
    let set_up = [load(0, CONSTANT | 1), load(1, CONSTANT), load(2, 0x4770)].concat();
    let mut machine = program(&[&set_up, &[0x4780, 0x800A, NEXT, 0x4780]]);
    machine.write(CONSTANT, &0x4770_u16.to_le_bytes()).unwrap();
    machine.set_estimate(Estimate::Worst).unwrap();
    assert_eq!(rules(&mut machine), [Breach::StaleCache { what: "code", address: CONSTANT }]);
}
