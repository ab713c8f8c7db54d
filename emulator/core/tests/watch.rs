//! Faults of the core that a test injects: a skipped instruction, a flipped bit of a register.

use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Machine, Model, Point, Stop};

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
    let chip = Stm32f4::new(Variant::F446, Board::default());
    let mut machine = Machine::new(Model::stm32f4(512 * 1024), chip).unwrap();
    let mut flash: Vec<u8> = [RAM + 0x1000, CODE | 1].into_iter().flat_map(u32::to_le_bytes).collect();
    flash.extend(PROGRAM.into_iter().flat_map(u16::to_le_bytes));
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

/// The values of R2 and R3 that the program has stored.
fn result(machine: &mut Machine<Stm32f4>) -> [u8; 2] {
    run(machine);
    let mut bytes = [0; 8];
    machine.read(RAM, &mut bytes).unwrap();
    [bytes[0], bytes[4]]
}

#[test]
fn a_program_that_is_only_watched_does_what_it_does() {
    let mut machine = machine(&[]);
    assert_eq!(result(&mut machine), [3, 0]);
    let visits = machine.visits();
    let first = |address| visits.iter().find(|point| point.address == address).map(|point| point.visit);
    assert_eq!((first(CODE), first(COMPARE), first(IT)), (Some(1), Some(1), Some(1)));
    assert!(first(CODE + 20).unwrap() > 10, "the last instruction runs again and again");
}

#[test]
fn one_moment_goes_on_in_many_ways() {
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
fn each_instruction_of_an_it_block_can_be_skipped() {
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
