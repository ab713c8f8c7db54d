//! Faults of the core that a test injects: a skipped instruction, a flipped bit of a register.

use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Flag, Machine, Model, Point, Stop};

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
/// The address of the first instruction, after stack pointer and entry.
const CODE: u32 = FLASH + 8;
const COMPARE: u32 = CODE + 8;
const IT: u32 = CODE + 10;
const THEN: u32 = CODE + 12;
const ELSE: u32 = CODE + 14;

/// `ldr r4, =RAM; movs r2, #0; movs r3, #0; movs r0, #1; cmp r0, #1; ite eq; moveq r2, #3; movne r3, #4; str r2, [r4]; str r3, [r4, #4];
/// b .`
const PROGRAM: [u16; 12] =
    [0x4C05, 0x2200, 0x2300, 0x2001, 0x2801, 0xBF0C, 0x2203, 0x2304, 0x6022, 0x6063, 0xE7FE, 0xBF00];

fn machine(stops: &[u32]) -> Machine<Stm32f4> {
    machine_with(&PROGRAM, stops)
}

fn machine_with(program: &[u16; 12], stops: &[u32]) -> Machine<Stm32f4> {
    let chip = Stm32f4::new(Variant::F446, Board::default());
    let mut machine = Machine::new(Model::stm32f4(512 * 1024), chip).unwrap();
    let mut flash: Vec<u8> = [RAM + 0x1000, CODE | 1].into_iter().flat_map(u32::to_le_bytes).collect();
    flash.extend(program.iter().flat_map(|half| half.to_le_bytes()));
    flash.extend(RAM.to_le_bytes());
    machine.set_flash(&flash).unwrap();
    machine.power_on(Time::ZERO);
    machine.watch(stops.iter().map(|&address| Point { address, visit: 1 })).unwrap();
    machine
}

fn run(machine: &mut Machine<Stm32f4>) -> Stop {
    let until = machine.now() + Time::from_micros(100);
    // At power-on the chip reports a change for the bus; this test has no bus.
    loop {
        match machine.run_until(until) {
            Stop::Poked => (),
            stop => return stop,
        }
    }
}

/// A program with one check: 'R0 is 1', which is wrong. Whatever is skipped, the program does not get behind the second `b .`.
///
/// `ldr r4, =RAM; movs r0, #3; cmp r0, #1; beq yes; movs r2, #4; str r2, [r4]; b .; b .; yes: movs r2, #3; str r2, [r4]; b .`
const CHECK: [u16; 12] =
    [0x4C05, 0x2003, 0x2801, 0xD003, 0x2204, 0x6022, 0xE7FE, 0xE7FE, 0x2203, 0x6022, 0xE7FE, 0xBF00];
const BRANCH: u32 = CODE + 6;
const YES: u8 = 3;
const NO: u8 = 4;

/// The values of R2 and R3 that the program has stored.
fn result(machine: &mut Machine<Stm32f4>) -> [u8; 2] {
    run(machine);
    let mut bytes = [0; 8];
    machine.read(RAM, &mut bytes).unwrap();
    [bytes[0], bytes[4]]
}

#[test]
fn a_watched_program_is_not_changed() {
    let mut machine = machine(&[]);
    assert_eq!(result(&mut machine), [3, 0]);
    let visits = machine.visits();
    let first = |address| visits.iter().find(|point| point.address == address).map(|point| point.visit);
    assert_eq!((first(CODE), first(COMPARE), first(IT)), (Some(1), Some(1), Some(1)));
    assert!(first(CODE + 20).unwrap() > 10, "the last instruction runs again and again");
}

#[test]
fn one_state_continues_with_many_faults() {
    let mut machine = machine(&[COMPARE, IT]);
    assert_eq!(run(&mut machine), Stop::Watched);
    assert_eq!(machine.stopped(), Some(Point { address: COMPARE, visit: 1 }));
    machine.unwatch().unwrap();
    let moment = machine.moment().unwrap();
    assert_eq!(result(&mut machine), [3, 0], "nothing was changed");
    machine.go_back(&moment).unwrap();
    machine.skip((COMPARE, 2)).unwrap();
    assert_eq!(result(&mut machine), [0, 4], "without the comparison the flags are those of the one before");
    machine.go_back(&moment).unwrap();
    machine.flip(0, 0);
    assert_eq!(result(&mut machine), [0, 4], "R0 is 0");
    machine.go_back(&moment).unwrap();
    machine.flip(2, 7);
    assert_eq!(result(&mut machine), [3, 0], "R2 is written after it");
    machine.go_back(&moment).unwrap();
    machine.resume_watch().unwrap();
    assert_eq!(
        (run(&mut machine), machine.stopped()),
        (Stop::Watched, Some(Point { address: IT, visit: 1 }))
    );
}

#[test]
fn every_instruction_of_an_it_block_can_be_skipped() {
    let mut machine = machine(&[IT]);
    assert_eq!(run(&mut machine), Stop::Watched);
    machine.unwatch().unwrap();
    assert_eq!(machine.next_instructions(), [(IT, 2), (THEN, 2), (ELSE, 2)]);
    let moment = machine.moment().unwrap();
    for (skipped, left) in [(IT, [3, 4]), (THEN, [0, 0]), (ELSE, [3, 0])] {
        machine.skip((skipped, 2)).unwrap();
        assert_eq!(result(&mut machine), left, "{skipped:#x}");
        machine.go_back(&moment).unwrap();
    }
    assert_eq!(result(&mut machine), [3, 0], "the program is as it was");
}

#[test]
fn a_flag_makes_a_branch_go_the_other_way_where_no_skip_does() {
    // To the first `b .`: nothing gets farther.
    for address in (CODE..CODE + 14).step_by(2) {
        let mut machine = machine_with(&CHECK, &[address]);
        assert_eq!(run(&mut machine), Stop::Watched);
        machine.unwatch().unwrap();
        machine.skip((address, 2)).unwrap();
        assert_ne!(result(&mut machine)[0], YES, "without {address:#x}");
    }
    let mut machine = machine_with(&CHECK, &[BRANCH]);
    assert_eq!(run(&mut machine), Stop::Watched);
    machine.unwatch().unwrap();
    let moment = machine.moment().unwrap();
    for (flag, says) in [(Flag::Z, YES), (Flag::N, NO), (Flag::C, NO), (Flag::V, NO)] {
        machine.flip_flag(flag);
        assert_eq!(result(&mut machine)[0], says, "{flag:?}");
        machine.go_back(&moment).unwrap();
    }
    assert_eq!(result(&mut machine)[0], NO, "the flags are as they were");
}

#[test]
fn each_flag_is_the_one_that_its_conditions_read() {
    // `beq`, `bmi`, `bcs`, `bvs` after `cmp r0, #1`: 3 - 1 is not zero, not negative, borrows nothing, does not overflow.
    for (flag, branch, before, after) in [
        (Flag::Z, 0xD003, NO, YES),
        (Flag::N, 0xD403, NO, YES),
        (Flag::C, 0xD203, YES, NO),
        (Flag::V, 0xD603, NO, YES),
    ] {
        let mut program = CHECK;
        program[3] = branch;
        let mut machine = machine_with(&program, &[BRANCH]);
        run(&mut machine);
        machine.unwatch().unwrap();
        let moment = machine.moment().unwrap();
        assert_eq!(result(&mut machine)[0], before, "{flag:?} as it is");
        machine.go_back(&moment).unwrap();
        machine.flip_flag(flag);
        assert_eq!(result(&mut machine)[0], after, "{flag:?} flipped");
    }
}

#[test]
fn a_fault_can_be_injected_between_instructions_of_an_it_block() {
    let mut machine = machine(&[IT]);
    assert_eq!(run(&mut machine), Stop::Watched);
    machine.unwatch().unwrap();
    let moment = machine.moment().unwrap();
    for (address, left) in [(IT, [0, 4]), (THEN, [0, 4]), (ELSE, [3, 4])] {
        machine.go_into_block(address).unwrap();
        machine.flip_flag(Flag::Z);
        assert_eq!(result(&mut machine), left, "another condition from {address:#x} on");
        machine.go_back(&moment).unwrap();
    }
    for (address, left) in [(IT, [3, 0]), (THEN, [3, 0]), (ELSE, [1, 0])] {
        machine.go_into_block(address).unwrap();
        machine.flip(2, 1);
        assert_eq!(result(&mut machine), left, "R2 before {address:#x}");
        machine.go_back(&moment).unwrap();
    }
    assert_eq!(result(&mut machine), [3, 0], "the program is as it was");
}

/// `ldr r4, =0xE000_ED0C; ldr r0, =0x05FA_0004; str r0, [r4]; b .`, the constants at the end: AIRCR, which resets the chip.
const RESTART: [u16; 12] =
    [0x4C03, 0x4804, 0x6020, 0xE7FE, 0xBF00, 0xBF00, 0xBF00, 0xBF00, 0xED0C, 0xE000, 0x0004, 0x05FA];

#[test]
fn a_program_stops_at_a_reset_before_anything_runs() {
    let mut machine = machine_with(&RESTART, &[CODE]);
    machine.stop_at_resets(true);
    assert_eq!(run(&mut machine), Stop::Watched);
    machine.unwatch().unwrap();
    let moment = machine.moment().unwrap();
    for _ in 0..2 {
        assert_eq!(run(&mut machine), Stop::Reset);
        assert_eq!(machine.next_instructions().first(), Some(&(CODE, 2)));
        machine.go_back(&moment).unwrap();
    }
    machine.stop_at_resets(false);
    assert_eq!(run(&mut machine), Stop::Reached);
}
