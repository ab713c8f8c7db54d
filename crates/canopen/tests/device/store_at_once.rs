//! Jobs that meet: an equal request while a job runs, and objects that are stored at once. What is answered with OK is
//! stored, what is refused has no effect.

use crate::bench::{Bench, DICTIONARY};
use canopen::dictionary::{Group, Groups};
use canopen::sdo::{Abort, Bytes, Initiate, Multiplexer, Request, Segment};
use canopen::{Action, Frame, Job};

const APPLICATION: Groups = Groups::one(Group::Application);
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 3, b's', b'a', b'v', b'e'];
const SAVED: [u8; 8] = [0x60, 0x10, 0x10, 3, 0, 0, 0, 0];
/// 6201h, which is stored at once.
const PRESET: u16 = 0x6201;
const DEVICE_STATE: u32 = 0x0800_0022;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;
const RPDO: u16 = 0x205;
const EMCY: u16 = 0x085;

fn booted() -> Bench {
    prepared(Bench::booted())
}

fn prepared(mut bench: Bench) -> Bench {
    bench.device.application_mut().stores = Some(APPLICATION);
    while bench.take_action().is_some() {}
    bench
}

/// An operational device whose RPDO 1 maps 6201h, or is multiplexed.
fn with_rpdo(is_multiplexed: bool) -> Bench {
    let mut bench = Bench::operational();
    bench.write(0x1600, 0, &[0]).unwrap();
    if is_multiplexed {
        bench.write(0x1600, 0, &[0xFF]).unwrap();
    } else {
        bench.write32(0x1600, 1, 0x6201_0008).unwrap();
        bench.write(0x1600, 0, &[1]).unwrap();
    }
    bench.write32(0x1400, 1, RPDO.into()).unwrap();
    prepared(bench)
}

/// Sends a request whose response waits.
fn request(bench: &mut Bench, data: [u8; 8]) {
    assert_eq!(bench.ask_raw(data), None, "the response waits");
}

fn preset(value: u8) -> [u8; 8] {
    [0x2F, 1, 0x62, 0, value, 0, 0, 0]
}

fn value(bench: &Bench) -> u8 {
    DICTIONARY.field(PRESET, 0).u8(bench.device.image())
}

fn job(bench: &mut Bench) -> Option<Job> {
    match bench.take_action() {
        None => None,
        Some(Action::Store(job)) => Some(job),
        other => panic!("{other:?}"),
    }
}

/// The responses of the SDO server at the end of a job.
fn finish(bench: &mut Bench, result: Result<(), Abort>) -> Vec<Vec<u8>> {
    bench.take();
    bench.finish(result);
    bench.sent().into_iter().filter(|(id, _)| *id == 0x585).map(|(_, data)| data).collect()
}

/// The values of the first run were copied before the second request.
#[test]
fn a_repeated_request_runs_a_handed_over_job_again_and_waits_for_the_second_run() {
    for first in [SAVE, preset(1)] {
        for second in [SAVE, preset(2)] {
            let mut bench = booted();
            request(&mut bench, first);
            assert_eq!(job(&mut bench), Some(Job::Store(APPLICATION)));
            request(&mut bench, second);
            assert_eq!(job(&mut bench), None, "one run at a time");
            assert_eq!(finish(&mut bench, Ok(())), [[0; 8]; 0], "the second request is not stored yet");
            assert_eq!(job(&mut bench), Some(Job::Store(APPLICATION)), "{first:x?}, {second:x?}");
            let answered = finish(&mut bench, Ok(()));
            assert_eq!(answered.len(), 1);
            assert_eq!((answered[0][0], &answered[0][1..4]), (0x60, &second[1..4]));
            assert_eq!((job(&mut bench), finish(&mut bench, Ok(())).len()), (None, 0));
        }
    }
}

#[test]
fn the_second_run_decides_the_response_to_the_second_request() {
    for (first, second) in [(Ok(()), Err(Abort::Hardware)), (Err(Abort::Hardware), Ok(()))] {
        let mut bench = booted();
        request(&mut bench, SAVE);
        job(&mut bench);
        request(&mut bench, SAVE);
        assert_eq!(finish(&mut bench, first), [[0; 8]; 0]);
        job(&mut bench);
        let answered = finish(&mut bench, second);
        let is_good = answered == [SAVED];
        assert_eq!((answered.len(), is_good), (1, second.is_ok()));
    }
}

#[test]
fn a_preset_is_refused_without_effect_while_another_job_runs() {
    let mut bench = booted();
    request(&mut bench, [0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e']);
    job(&mut bench);
    bench.told();
    bench.take_parameters();
    assert_eq!(bench.write(PRESET, 0, &[7]), Err(DEVICE_STATE));
    assert_eq!((value(&bench), bench.told(), bench.take_parameters()), (0, vec![], false));
}

#[test]
fn no_request_has_an_effect_while_the_memory_accepts_no_job() {
    for abort in [Abort::DeviceState, Abort::Hardware] {
        let mut bench = booted();
        bench.device.application_mut().is_full = Some(abort);
        bench.told();
        let requests: [(u16, u8, &[u8]); 5] = [
            (PRESET, 0, &[7]),
            (0x1010, 3, b"save"),
            (0x1011, 3, b"load"),
            (0x6107, 0, b"save"),
            (0x5F00, 0, &[2]),
        ];
        for (index, sub, bytes) in requests {
            assert_eq!(bench.write(index, sub, bytes), Err(abort.code()), "{index:X}h");
            assert_eq!((job(&mut bench), bench.told(), value(&bench)), (None, vec![], 0), "{index:X}h");
        }
        assert_eq!(bench.write(0x6100, 0, &[3, 0]), Ok(()), "stored by 1010h only");
    }
}

#[test]
fn a_repeated_request_is_refused_when_the_memory_has_no_room_for_a_second_run() {
    let mut bench = booted();
    request(&mut bench, preset(1));
    job(&mut bench);
    bench.device.application_mut().is_full = Some(Abort::DeviceState);
    assert_eq!(bench.write(PRESET, 0, &[2]), Err(DEVICE_STATE));
    assert_eq!(value(&bench), 1, "the preset before is in force, and is being stored");
    finish(&mut bench, Ok(()));
    assert_eq!(job(&mut bench), None);
}

#[test]
fn a_preset_by_rpdo_is_stored_or_has_no_effect() {
    let mut bench = with_rpdo(false);
    bench.receive(Frame::new(RPDO, &[7]).unwrap());
    assert_eq!((job(&mut bench), value(&bench)), (Some(Job::Store(APPLICATION)), 7));
    bench.receive(Frame::new(RPDO, &[8]).unwrap());
    assert_eq!(finish(&mut bench, Ok(())), [[0; 8]; 0]);
    assert_eq!((job(&mut bench), value(&bench)), (Some(Job::Store(APPLICATION)), 8), "runs again");
    finish(&mut bench, Ok(()));
    bench.device.application_mut().is_full = Some(Abort::DeviceState);
    bench.receive(Frame::new(RPDO, &[9]).unwrap());
    assert_eq!((job(&mut bench), value(&bench)), (None, 8));
}

#[test]
fn a_preset_by_multiplexed_pdo_is_stored_or_reported() {
    let codes = |bench: &mut Bench| -> Vec<u16> {
        let emcys = bench.sent().into_iter().filter(|(id, _)| *id == EMCY);
        emcys.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).collect()
    };
    let mut bench = with_rpdo(true);
    let mpdo = |value| Frame::new(RPDO, &[0x85, 1, 0x62, 0, value, 0, 0, 0]).unwrap();
    bench.receive(mpdo(7));
    assert_eq!((job(&mut bench), value(&bench)), (Some(Job::Store(APPLICATION)), 7));
    assert_eq!(finish(&mut bench, Ok(())), [[0; 8]; 0]);
    bench.device.application_mut().is_full = Some(Abort::DeviceState);
    bench.take();
    bench.receive(mpdo(8));
    assert_eq!((job(&mut bench), value(&bench)), (None, 7));
    assert_eq!(codes(&mut bench).first(), Some(&0x8230));
}

#[test]
fn a_refused_preset_is_not_stored() {
    let mut bench = booted();
    assert_eq!(bench.write(PRESET, 0, &[13]), Err(0x0609_0030), "by the application");
    assert_eq!((job(&mut bench), value(&bench)), (None, 0));
}

/// The setting has a job of its own.
#[test]
fn a_setting_begins_one_job_although_the_application_stores_the_entry_too() {
    let mut bench = booted();
    bench.device.application_mut().stored_at_once = 0x5F00;
    request(&mut bench, [0x2F, 0, 0x5F, 0, 2, 0, 0, 0]);
    assert_eq!(job(&mut bench), Some(Job::Setting(2)));
    assert_eq!(finish(&mut bench, Ok(())), [[0x60, 0, 0x5F, 0, 0, 0, 0, 0]]);
    assert_eq!(job(&mut bench), None);
    assert_eq!(bench.write(0x6200, 0, &[0, 0]), Ok(()), "the next request is answered at once");
}

/// A restore waits for the reset that loads the group. A write that stores the group again would end it.
#[test]
fn a_restore_is_ended_by_a_save_and_by_the_reset_only() {
    for sub in [1, 3] {
        let mut bench = booted();
        let load = [0x23, 0x11, 0x10, sub, b'l', b'o', b'a', b'd'];
        request(&mut bench, load);
        assert!(matches!(job(&mut bench), Some(Job::Restore(_))));
        assert_eq!(finish(&mut bench, Ok(())), [[0x60, 0x11, 0x10, sub, 0, 0, 0, 0]]);
        let before = value(&bench);
        assert_eq!(bench.write(PRESET, 0, &[7]), Err(DEVICE_STATE));
        assert_eq!((value(&bench), job(&mut bench)), (before, None), "no effect");
        // A save of the same values, as the client wishes.
        request(&mut bench, SAVE);
        assert!(matches!(job(&mut bench), Some(Job::Store(_))));
        assert_eq!(finish(&mut bench, Ok(())), [SAVED]);
        request(&mut bench, preset(7));
        assert!(matches!(job(&mut bench), Some(Job::Store(_))));
        finish(&mut bench, Ok(()));
        // Again, and the resets.
        request(&mut bench, load);
        job(&mut bench);
        finish(&mut bench, Ok(()));
        for (command, is_over) in [(RESET_COMMUNICATION, false), (RESET_NODE, true)] {
            bench.nmt(command);
            bench.start();
            while bench.take_action().is_some() {}
            let is_refused = bench.ask_raw(preset(8)).is_some();
            assert_eq!(is_refused, !is_over, "1011h:{sub}, {command:X}h");
        }
    }
}

/// A restore that fails leaves the stored values, and a save that fails leaves a restore that waits.
#[test]
fn a_job_that_fails_neither_begins_nor_ends_the_wait_of_a_restore() {
    const LOAD: [u8; 8] = [0x23, 0x11, 0x10, 3, b'l', b'o', b'a', b'd'];
    let run = |bench: &mut Bench, data, result| {
        request(bench, data);
        job(bench);
        assert_eq!(finish(bench, result)[0][0], if result.is_ok() { 0x60 } else { 0x80 });
    };
    let mut bench = booted();
    run(&mut bench, LOAD, Err(Abort::Hardware));
    run(&mut bench, preset(7), Ok(()));
    assert_eq!(value(&bench), 7, "no restore waits");
    run(&mut bench, LOAD, Ok(()));
    run(&mut bench, SAVE, Err(Abort::Hardware));
    assert_eq!((bench.write(PRESET, 0, &[8]), value(&bench)), (Err(DEVICE_STATE), 7), "the restore waits");
}

/// 6200h has no limits, no handler and no group: its values are written to the image without a check.
#[test]
fn an_object_without_a_check_is_stored_at_once_by_an_rpdo_too() {
    for (stored, expected) in [(0x6200, Some(Job::Store(APPLICATION))), (0x5F00, None)] {
        let mut bench = prepared(Bench::operational());
        bench.device.application_mut().stored_at_once = stored;
        bench.write(0x1600, 0, &[0]).unwrap();
        bench.write32(0x1600, 1, 0x6200_0010).unwrap();
        bench.write(0x1600, 0, &[1]).unwrap();
        bench.write32(0x1400, 1, RPDO.into()).unwrap();
        while bench.take_action().is_some() {}
        bench.receive(Frame::new(RPDO, &[9, 0]).unwrap());
        assert_eq!(job(&mut bench), expected);
        assert_eq!(DICTIONARY.field(0x6200, 0).u16(bench.device.image()), 9);
    }
}

#[test]
fn a_second_restore_of_the_same_group_waits_for_the_reset_too() {
    for (first, second) in [(3, 3), (1, 3), (3, 1)] {
        let mut bench = booted();
        for sub in [first, second] {
            request(&mut bench, [0x23, 0x11, 0x10, sub, b'l', b'o', b'a', b'd']);
            assert!(matches!(job(&mut bench), Some(Job::Restore(_))));
            assert_eq!(finish(&mut bench, Ok(())).len(), 1);
            assert_eq!(bench.write(PRESET, 0, &[7]), Err(DEVICE_STATE), "1011h:{first}, 1011h:{second}");
        }
    }
}

#[test]
fn the_last_segment_of_a_preset_is_answered_when_the_preset_is_stored() {
    let mut bench = booted();
    let at = Multiplexer { index: PRESET, sub: 0 };
    assert!(bench.ask(Request::Download(at, Initiate::Segmented(Some(1)))).is_some());
    let segment = Segment { toggle: false, last: true, data: Bytes::from_slice(&[7]) };
    assert_eq!(bench.ask(Request::DownloadSegment(segment)), None, "the response waits");
    assert_eq!((job(&mut bench), value(&bench)), (Some(Job::Store(APPLICATION)), 7));
    assert_eq!(finish(&mut bench, Ok(())), [[0x20, 0, 0, 0, 0, 0, 0, 0]]);
}
