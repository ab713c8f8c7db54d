//! 2002h: the confirmation and the withdrawal of a new program, and the values of the object.

use canopen::Frame;
use host_tests::bench::Bench;
use node::fault::PROGRAM_TAKEN_BACK;
use node::{Instant, Verdict};
use profiles::Personality;
use update::{Cause, Event, Log, Outcome, Programs, Reason, Trial, Version};

const STATE: u8 = 1;
const COMMAND: u8 = 2;
const LIMIT: u8 = 3;
const AUTOMATIC: u8 = 4;
const DEVICE_STATE: Result<(), u32> = Err(0x0800_0022);
const INVALID: Result<(), u32> = Err(0x0609_0030);

/// A measuring node whose program is on trial.
fn on_trial() -> Bench {
    let mut bench = Bench::booted();
    bench.protocol.set_trial(Trial::Open);
    bench.restart();
    bench.sample(&host_tests::bench::raw(0.0, 298.15));
    bench
}

/// The verdict of the node on the trial, `seconds` after its start.
fn verdict(bench: &mut Bench, seconds: f64) -> Option<Verdict> {
    bench.protocol.judge(at(seconds), true);
    bench.protocol.verdict()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few seconds fit.
fn at(seconds: f64) -> Instant {
    Instant((seconds * 1e6) as u64)
}

/// A message of a master.
type Speech = fn(&mut Bench);

fn state(bench: &mut Bench) -> u8 {
    bench.read(0x2002, STATE).unwrap()[0]
}

fn time(bench: &mut Bench, sub: u8, seconds: u16) {
    bench.write(0x2002, sub, &seconds.to_le_bytes()).unwrap();
}

/// A node that has received no message of a master, with these times.
fn left_alone(limit: u16, automatic: u16) -> Bench {
    let mut bench = Bench::booted();
    time(&mut bench, LIMIT, limit);
    time(&mut bench, AUTOMATIC, automatic);
    bench.sample(&host_tests::bench::raw(0.0, 298.15));
    // Messages before this point do not count.
    bench.protocol.end_trial();
    bench.protocol.set_trial(Trial::Open);
    bench
}

#[test]
fn the_programs_in_the_flash_are_read_by_an_object_of_every_personality() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        let programs = Programs {
            counter: 7,
            generation: 0x28,
            staged: 0x0102_0304,
            kept: 0x0506_0708,
            erases: 0x0A0B,
            clears_allowed: 49,
        };
        bench.protocol.set_programs(programs);
        bench.restart();
        let mut read = |sub| bench.read(0x2004, sub).unwrap();
        assert_eq!((read(2), read(3)), (vec![7, 0, 0, 0], vec![0x28]), "{personality:?}");
        assert_eq!((read(4), read(5)), (vec![4, 3, 2, 1], vec![8, 7, 6, 5]), "{personality:?}");
        assert_eq!((read(6), read(7)), (vec![0x0B, 0x0A], vec![49]), "{personality:?}");
        assert!(bench.write(0x2004, 2, &[0; 4]).is_err());
    }
}

#[test]
fn the_log_of_updates_is_read_by_an_object_of_every_personality() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        assert_eq!(bench.read(0x2006, 0), Ok(vec![0; Log::LEN]), "{personality:?}: no event");
        let version = Version { major: 1, minor: 2, patch: 3 };
        let mut log = Log::EMPTY;
        for outcome in [Outcome::OnTrial, Outcome::Confirmed(Cause::Command)] {
            log.add(&Event { outcome, version, generation: 16 });
        }
        bench.protocol.set_update_log(log);
        bench.restart();
        let read = bench.read(0x2006, 0).unwrap();
        assert_eq!(read[..16], [3, 1, 0, 0, 1, 2, 3, 16, 1, 0, 0, 0, 1, 2, 3, 16], "{personality:?}");
        assert!(bench.write(0x2006, 0, &[0; 8]).is_err());
    }
}

#[test]
fn a_program_is_confirmed_ten_seconds_after_its_start_when_a_master_has_spoken() {
    let speaks: [(&str, Speech); 3] = [
        ("an SDO request", |bench| assert!(bench.read(0x1000, 0).is_ok())),
        ("an NMT command", |bench| bench.nmt(1)),
        ("a heartbeat", |bench| {
            bench.write(0x1016, 1, &0x0002_03E8_u32.to_le_bytes()).unwrap();
            bench.protocol.end_trial();
            bench.protocol.set_trial(Trial::Open);
            bench.receive(&Frame::new(0x702, &[5]).unwrap());
        }),
    ];
    for (who, speak) in speaks {
        let mut bench = left_alone(600, 0);
        assert_eq!(verdict(&mut bench, 599.0), None, "nobody has spoken");
        speak(&mut bench);
        assert_eq!(verdict(&mut bench, 9.9), None, "{who}");
        assert_eq!(verdict(&mut bench, 10.0), Some(Verdict::Confirm(Cause::Master)), "{who}");
        bench.protocol.end_trial();
        assert_eq!((verdict(&mut bench, 20.0), state(&mut bench)), (None, 0));
    }
}

#[test]
fn frames_for_others_do_not_confirm() {
    let mut bench = left_alone(600, 0);
    for id in [0x080, 0x181, 0x602, 0x582, 0x7E5] {
        bench.receive(&Frame::new(id, &[0; 8]).unwrap());
    }
    assert_eq!(verdict(&mut bench, 30.0), None);
}

#[test]
fn off_the_bus_and_without_a_measurement_nothing_is_confirmed() {
    let mut bench = on_trial();
    bench.protocol.judge(at(11.0), false);
    assert_eq!(bench.protocol.verdict(), None);
    let mut bench = Bench::booted();
    bench.protocol.set_trial(Trial::Open);
    bench.read(0x1000, 0).unwrap();
    assert_eq!(verdict(&mut bench, 11.0), None, "nothing was measured");
    assert_eq!(bench.write(0x2002, COMMAND, b"conf"), DEVICE_STATE);
    assert_eq!(verdict(&mut bench, 600.0), Some(Verdict::TakeBack(Cause::Time)));
}

#[test]
fn without_a_master_the_program_before_comes_back_in_time_or_the_new_one_is_confirmed_by_itself() {
    for (limit, automatic, seconds, then) in [
        (600, 0, 599.9, None),
        (600, 0, 600.0, Some(Verdict::TakeBack(Cause::Time))),
        (0, 0, 60_000.0, None),
        (600, 5, 4.9, None),
        (600, 5, 5.0, Some(Verdict::Confirm(Cause::Time))),
        (5, 10, 5.0, Some(Verdict::TakeBack(Cause::Time))),
    ] {
        let mut bench = left_alone(limit, automatic);
        assert_eq!(verdict(&mut bench, seconds), then, "{limit} s, {automatic} s, after {seconds} s");
    }
}

#[test]
fn a_master_ends_the_trial_by_command_and_gets_its_answer_first() {
    for (word, then) in
        [(b"conf", Verdict::Confirm(Cause::Command)), (b"back", Verdict::TakeBack(Cause::Command))]
    {
        let mut bench = on_trial();
        assert_eq!(state(&mut bench), 1);
        bench.write(0x2002, COMMAND, word).unwrap();
        assert_eq!(verdict(&mut bench, 1.0), None, "the answer goes first");
        assert_eq!(verdict(&mut bench, 1.02), Some(then));
    }
}

#[test]
fn other_commands_and_commands_without_a_trial_are_refused() {
    let mut bench = on_trial();
    for word in [b"CONF", b"save", &[0; 4]] {
        assert_eq!(bench.write(0x2002, COMMAND, word), INVALID);
    }
    bench.protocol.end_trial();
    for word in [b"conf", b"back"] {
        assert_eq!(bench.write(0x2002, COMMAND, word), DEVICE_STATE);
    }
    assert!(bench.read(0x2002, COMMAND).is_err(), "it is write only");
    assert!(bench.write(0x2002, STATE, &[0]).is_err(), "it is read only");
}

/// The times are parameters: stored, and present after a power cycle.
#[test]
fn the_times_are_stored() {
    let mut bench = Bench::booted();
    let read = |bench: &mut Bench| [LIMIT, AUTOMATIC].map(|sub| bench.read(0x2002, sub).unwrap());
    assert_eq!(read(&mut bench), [vec![0x58, 2], vec![0, 0]]);
    time(&mut bench, LIMIT, 77);
    time(&mut bench, AUTOMATIC, 7);
    bench.write(0x1010, 1, b"save").unwrap();
    assert_eq!(read(&mut bench.power_cycled()), [vec![77, 0], vec![7, 0]]);
}

#[test]
fn a_program_that_is_back_says_why() {
    for (reason, state_then, detail) in [(Reason::Starts, 2, 1), (Reason::Withdrawn, 3, 2)] {
        let mut bench = Bench::booted();
        bench.protocol.set_trial(Trial::Over(reason));
        bench.restart();
        assert_eq!(state(&mut bench), state_then);
        assert_eq!(bench.read(0x1F57, 1).unwrap(), [72 << 1, 0, detail, 0]);
        assert!(bench.protocol.is_taken_back() && !bench.protocol.is_on_trial());
        bench.set_fault(PROGRAM_TAKEN_BACK, true);
        bench.set_fault(PROGRAM_TAKEN_BACK, false);
        let history = bench.read(0x1003, 1).unwrap();
        assert_eq!(history[..2], [0x02, 0x61]);
        assert_eq!(bench.read(0x1001, 0).unwrap(), [0], "the program that runs is well");
        assert_eq!(verdict(&mut bench, 700.0), None);
    }
}
