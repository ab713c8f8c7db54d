//! The trial of a new program, with the real images: its confirmation, and every return to the previous program.

use canbus::Time;
use canopen::sdo::Multiplexer;
use host_tests::sdo::{Client, Failure};
use host_tests::thorough::either;
use host_tests::watch::expects;
use monitor::Rule;
use programmer::sign::image::Image;
use update::Status;

use super::bench::{Bench, CLEAR, START, signed, version_a, version_b};
use super::fleet::PERSONALITIES;
use crate::support::SECOND;

const fn trial(sub: u8) -> Multiplexer {
    Multiplexer { index: 0x2002, sub }
}

const STATE: Multiplexer = trial(1);
const COMMAND: Multiplexer = trial(2);
const LIMIT: Multiplexer = trial(3);
const AUTOMATIC: Multiplexer = trial(4);
const SAVE: Multiplexer = Multiplexer { index: 0x1010, sub: 1 };
const HEARTBEAT: Multiplexer = Multiplexer { index: 0x1017, sub: 0 };
const LAST_ERROR: Multiplexer = Multiplexer { index: 0x1003, sub: 1 };

/// Values of 2002h:1.
const NONE: u8 = 0;
const OPEN: u8 = 1;
const BACK_AFTER_STARTS: u8 = 2;
const BACK: u8 = 3;

fn write(bench: &mut Bench, at: Multiplexer, bytes: &[u8]) -> Result<(), Failure> {
    Client::new(bench).write(at, bytes)
}

fn state(bench: &mut Bench) -> u8 {
    bench.read(STATE).unwrap()[0]
}

/// A program with another instruction at its reset address.
fn broken(instruction: [u8; 2]) -> Image {
    const CODE: u32 = 0x0802_0200;
    let mut code = version_b(0).code;
    let reset = u32::from_le_bytes(code[4..8].try_into().unwrap()) & !1;
    let place = (reset - CODE) as usize;
    code[place..place + 2].copy_from_slice(&instruction);
    signed(code, |_| ())
}

/// All steps of an update before the start of the new program.
fn bring(bench: &mut Bench, image: &Image) {
    bench.stop();
    bench.clear();
    bench.download(&image.to_bytes()).unwrap();
    assert_eq!(bench.wait_for_flash(), Status::GOOD);
}

/// All steps of an update, without a dialogue with the new program.
fn put(bench: &mut Bench, image: &Image) {
    bring(bench, image);
    bench.command(START).unwrap();
}

/// Checks that A runs again, and reports the reason.
fn assert_a_is_back(bench: &mut Bench, state_then: u8, detail: u16) {
    assert_eq!(bench.identification_of_running(), version_a().header.code_crc());
    assert_eq!(state(bench), state_then);
    let status = bench.status();
    assert_eq!((status.code, status.detail), (72, detail), "{status}");
    assert_eq!(bench.read(LAST_ERROR).unwrap()[..2], [0x02, 0x61], "EMCY 6102h");
}

#[test]
fn a_program_that_a_master_speaks_to_is_confirmed_after_ten_seconds_and_stays() {
    let mut bench = Bench::running();
    bench.update(&version_b(0));
    assert_eq!(state(&mut bench), OPEN);
    bench.run(SECOND * 8);
    assert_eq!(state(&mut bench), OPEN);
    bench.run(SECOND * 2);
    assert_eq!(state(&mut bench), NONE);
    for _ in 0..4 {
        bench.power_cycle();
        assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    }
    assert_eq!((state(&mut bench), bench.status()), (NONE, Status::GOOD));
}

/// The program hangs until the watchdog resets the chip, or it faults at once.
#[test]
fn a_program_that_does_not_start_is_replaced_by_the_one_before_with_its_settings() {
    let _expected = expects([Rule::UnexpectedReset]);
    for instruction in [[0xFE, 0xE7], [0x00, 0xDE]] {
        let mut bench = Bench::new("--bitrate 500", 500_000, 1);
        bench.run(SECOND);
        write(&mut bench, HEARTBEAT, &[0x21, 3]).unwrap();
        write(&mut bench, SAVE, b"save").unwrap();
        put(&mut bench, &broken(instruction));
        bench.run(SECOND * 10);
        assert_a_is_back(&mut bench, BACK_AFTER_STARTS, 1);
        assert_eq!(bench.read(HEARTBEAT).unwrap(), [0x21, 3]);
        bench.update(&version_b(0));
        assert_eq!((state(&mut bench), bench.status()), (OPEN, Status::GOOD), "another trial");
        assert_eq!(bench.world.summary(1.0, 0).bus.errors, 0);
    }
}

#[test]
fn an_unconfirmed_program_is_rolled_back_in_time() {
    let mut bench = Bench::running();
    write(&mut bench, LIMIT, &[12, 0]).unwrap();
    write(&mut bench, SAVE, b"save").unwrap();
    put(&mut bench, &version_b(0));
    bench.run(SECOND * 20);
    assert_a_is_back(&mut bench, BACK, 2);
}

#[test]
fn with_automatic_confirmation_a_program_needs_no_master() {
    let mut bench = Bench::running();
    for (at, seconds) in [(LIMIT, 12), (AUTOMATIC, 5)] {
        write(&mut bench, at, &[seconds, 0]).unwrap();
    }
    write(&mut bench, SAVE, b"save").unwrap();
    put(&mut bench, &version_b(0));
    bench.run(SECOND * 20);
    assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    assert_eq!(state(&mut bench), NONE);
}

#[test]
fn three_times_without_power_before_a_confirmation_bring_the_program_before_back() {
    let mut bench = Bench::running();
    put(&mut bench, &version_b(0));
    bench.run(SECOND);
    for _ in 0..2 {
        bench.power_cycle();
        assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    }
    bench.power_cycle();
    bench.run(SECOND * 3);
    assert_a_is_back(&mut bench, BACK_AFTER_STARTS, 1);
}

#[test]
fn a_master_confirms_or_rolls_back_and_nothing_is_stored_before() {
    let mut bench = Bench::running();
    bench.update(&version_b(0));
    assert_eq!(write(&mut bench, SAVE, b"save"), Err(Failure::Refused(0x0800_0022)), "on trial");
    write(&mut bench, COMMAND, b"back").unwrap();
    bench.run(SECOND * 3);
    assert_a_is_back(&mut bench, BACK, 2);
    write(&mut bench, SAVE, b"save").unwrap();
    bench.update(&version_b(0));
    write(&mut bench, COMMAND, b"conf").unwrap();
    bench.run(Time::from_millis(100));
    assert_eq!(state(&mut bench), NONE);
    write(&mut bench, SAVE, b"save").unwrap();
    assert_eq!(write(&mut bench, COMMAND, b"back"), Err(Failure::Refused(0x0800_0022)), "there is no trial");
}

/// The bootloader refuses the next update until the trial is decided, and the trial is as before.
#[test]
fn a_second_update_during_a_trial_is_refused_and_ends_nothing() {
    const ON_TRIAL: u8 = 73;
    for (personality, node) in PERSONALITIES.into_iter().zip([1, 16, 127, 1]) {
        let mut bench = Bench::new(&format!("--bitrate 500 --node {node}:{personality}"), 500_000, node);
        bench.run(SECOND);
        bench.update(&version_b(0));
        bench.stop();
        assert_eq!(bench.command(CLEAR), Err(Failure::Refused(0x0800_0022)), "{personality}");
        assert_eq!(bench.status().code, ON_TRIAL);
        assert!(bench.download(&version_a().to_bytes()).is_err(), "{personality}");
        assert_eq!(bench.start(), version_b(0).header.code_crc());
        assert_eq!(state(&mut bench), OPEN, "{personality}");
        write(&mut bench, COMMAND, b"back").unwrap();
        bench.run(SECOND * 3);
        assert_a_is_back(&mut bench, BACK, 2);
        // The kept image of the next trial is the program that ran before it.
        bench.update(&version_b(0));
        write(&mut bench, COMMAND, b"back").unwrap();
        bench.run(SECOND * 3);
        assert_a_is_back(&mut bench, BACK, 2);
    }
}

/// One program is confirmed, the other one is withdrawn, independently. The two nodes have different personalities.
#[test]
fn two_nodes_are_on_trial_at_once_at_250_kbit_s() {
    let flags = "--bitrate 250 --node 1:pressure --node 2:encoder";
    let mut bench = Bench::new(flags, 250_000, 1);
    bench.run(SECOND);
    for node in [1, 2] {
        bench.node = node;
        bring(&mut bench, &version_b(0));
    }
    for node in [1, 2] {
        bench.node = node;
        bench.command(START).unwrap();
    }
    for node in [1, 2] {
        bench.node = node;
        assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
        assert_eq!(state(&mut bench), OPEN);
    }
    write(&mut bench, COMMAND, b"back").unwrap();
    bench.node = 1;
    write(&mut bench, COMMAND, b"conf").unwrap();
    bench.run(SECOND * 4);
    assert_eq!((state(&mut bench), bench.status()), (NONE, Status::GOOD));
    assert_eq!(bench.identification_of_running(), version_b(0).header.code_crc());
    bench.node = 2;
    assert_a_is_back(&mut bench, BACK, 2);
    assert_eq!(bench.world.summary(1.0, 0).bus.errors, 0);
}

/// Power cuts at some operations of the return: A runs after each of them.
#[test]
fn the_power_is_cut_during_a_rollback() {
    let _expected = expects([Rule::HeartbeatLate]);
    let mut bench = Bench::running();
    bench.update(&version_b(0));
    let flash = bench.machine().flash();
    let words = version_a().to_bytes().len() as u64 / 4;
    // Operations: the mark, the erase, the words of the image, and the two records.
    let all = 1 + 1 + words + 4 + 1;
    let cuts = either(4, 40);
    for cut in (0..cuts).map(|number| 1 + number * all / cuts).chain([2, 3, all - 4, all]) {
        bench.machine().set_flash(&flash).unwrap();
        bench.power_cycle();
        bench.run(SECOND);
        write(&mut bench, COMMAND, b"back").unwrap();
        bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(1 + cut);
        bench.run(SECOND * 3);
        bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(u64::MAX >> 1);
        bench.power_cycle();
        bench.run(SECOND * 3);
        assert_a_is_back(&mut bench, BACK, 2);
        bench.power_cycle();
        assert_a_is_back(&mut bench, BACK, 2);
    }
}
