//! Storing and loading: 1010h, 1011h, and the packed values.

use crate::bench::{Bench, DICTIONARY, ID};
use canopen::dictionary::{Access, Group, Groups, Object, Type, is_packed, packed_size};
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer, Request};
use canopen::{Action, Damage, Job, NodeId, Soundness};

const SAVE: [u8; 4] = *b"save";
const LOAD: [u8; 4] = *b"load";
const RESET_COMMUNICATION: u8 = 0x82;
const RESET_NODE: u8 = 0x81;

/// Writes a signature that the node accepts, and returns the job.
fn begin(bench: &mut Bench, index: u16, sub: u8, signature: [u8; 4]) -> Job {
    while bench.take_action().is_some() {}
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = signature;
    assert_eq!(bench.ask_raw([0x23, low, high, sub, a, b, c, d]), None, "the response waits");
    match bench.take_action() {
        Some(Action::Store(job)) => job,
        other => panic!("{other:?}"),
    }
}

fn finish(bench: &mut Bench, result: Result<(), Abort>) -> Vec<u8> {
    bench.take();
    bench.finish(result);
    let sent = bench.sent();
    assert_eq!(sent.len(), 1);
    sent[0].1.clone()
}

/// Does the work of the memory.
fn save(bench: &mut Bench) {
    let job = begin(bench, 0x1010, 1, SAVE);
    assert_eq!(job, Job::Store(Groups::ALL_PARAMETERS));
    for (number, group) in [Group::Communication, Group::Application].into_iter().enumerate() {
        bench.device.application_mut().stored[number] = packed(bench, group);
    }
    assert_eq!(finish(bench, Ok(())), [0x60, 0x10, 0x10, 1, 0, 0, 0, 0]);
}

fn packed(bench: &Bench, group: Group) -> Vec<u8> {
    let mut buffer = [0; 2048];
    let len = DICTIONARY.pack(group, bench.device.node_id(), bench.device.image(), &mut buffer).unwrap();
    buffer[..len].to_vec()
}

fn reset(bench: &mut Bench, command: u8) {
    bench.nmt(command);
    bench.start();
    bench.take();
}

#[test]
fn the_sub_index_selects_the_stored_and_restored_group() {
    let selections = [
        (1, Groups::ALL_PARAMETERS),
        (2, Groups::one(Group::Communication)),
        (3, Groups::one(Group::Application)),
    ];
    for (sub, selection) in selections {
        let mut bench = Bench::booted();
        assert_eq!(begin(&mut bench, 0x1010, sub, SAVE), Job::Store(selection));
        finish(&mut bench, Ok(()));
        assert_eq!(begin(&mut bench, 0x1011, sub, LOAD), Job::Restore(selection));
        finish(&mut bench, Ok(()));
        assert_eq!(bench.read(0x1010, sub), Ok(vec![1, 0, 0, 0]));
    }
}

#[test]
fn the_calibration_is_stored_by_its_own_command() {
    let mut bench = Bench::booted();
    let value = 2.5_f32.to_le_bytes();
    bench.write(0x6106, 0, &value).unwrap();
    assert_eq!(begin(&mut bench, 0x6107, 0, SAVE), Job::Store(Groups::one(Group::Calibration)));
    bench.device.application_mut().stored[2] = packed(&bench, Group::Calibration);
    finish(&mut bench, Ok(()));
    assert_eq!(bench.write(0x6107, 0, &LOAD), Err(0x0800_0020));
    assert_eq!(bench.read(0x6107, 0), Ok(vec![1, 0, 0, 0]));
    reset(&mut bench, RESET_NODE);
    assert_eq!(bench.read(0x6106, 0), Ok(value.to_vec()));
}

#[test]
fn the_other_commands_leave_the_calibration_alone() {
    for selection in
        [Groups::ALL_PARAMETERS, Groups::one(Group::Communication), Groups::one(Group::Application)]
    {
        assert!(!selection.contains(Group::Calibration));
    }
    assert!(Groups::one(Group::Calibration).contains(Group::Calibration));
    assert!(!Groups::one(Group::Calibration).contains(Group::Application));
}

#[test]
fn a_wrong_signature_stores_nothing() {
    let mut bench = Bench::booted();
    bench.take_action();
    for (index, signature) in [(0x1010, LOAD), (0x1011, SAVE), (0x1010, *b"SAVE"), (0x1011, [0; 4])] {
        assert_eq!(bench.write(index, 1, &signature), Err(0x0800_0020));
        assert_eq!(bench.take_action(), None);
    }
    assert_eq!(bench.write(0x1010, 4, &SAVE), Err(0x0609_0011));
}

#[test]
fn a_failing_memory_is_reported_to_the_client() {
    let mut bench = Bench::booted();
    begin(&mut bench, 0x1010, 1, SAVE);
    assert_eq!(finish(&mut bench, Err(Abort::Hardware)), [0x80, 0x10, 0x10, 1, 0, 0, 6, 6]);
}

#[test]
fn a_repeated_request_waits_for_the_same_job_and_another_one_is_refused() {
    let mut bench = Bench::booted();
    begin(&mut bench, 0x1010, 2, SAVE);
    assert_eq!(bench.ask_raw([0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e']), None);
    assert_eq!(bench.take_action(), None);
    assert_eq!(bench.write(0x1010, 3, &SAVE), Err(0x0800_0022));
    // The client has continued with another transfer, so no client waits for the first job.
    bench.take();
    bench.finish(Ok(()));
    assert_eq!(bench.sent(), []);
}

#[test]
fn the_client_can_do_something_else_meanwhile() {
    let mut bench = Bench::booted();
    begin(&mut bench, 0x1010, 1, SAVE);
    assert_eq!(bench.read(0x1000, 0), Ok(vec![0x94, 1, 2, 0]));
}

/// The client waits for the server: the time-out is the client's.
#[test]
fn a_slow_memory_does_not_time_out() {
    let mut bench = Bench::booted();
    begin(&mut bench, 0x1010, 1, SAVE);
    bench.run(canopen::Duration::from_millis(5000));
    assert!(bench.sent().iter().all(|(id, _)| *id != 0x585), "no response before the end of the job");
    assert_eq!(finish(&mut bench, Ok(())), [0x60, 0x10, 0x10, 1, 0, 0, 0, 0]);
}

#[test]
fn a_client_that_has_aborted_gets_no_response_of_its_job() {
    let mut bench = Bench::booted();
    begin(&mut bench, 0x1010, 1, SAVE);
    bench.run(canopen::Duration::from_millis(5000));
    assert_eq!(bench.ask(Request::Abort(Multiplexer { index: 0x1010, sub: 1 }, 0x0504_0000)), None);
    bench.take();
    bench.finish(Ok(()));
    assert_eq!(bench.sent(), []);
}

#[test]
fn communication_parameters_come_back_with_reset_communication_and_the_others_with_reset_node() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &500_u16.to_le_bytes()).unwrap();
    bench.write(0x6100, 0, &[4, 0]).unwrap();
    save(&mut bench);
    bench.write(0x1017, 0, &250_u16.to_le_bytes()).unwrap();
    bench.write(0x6100, 0, &[5, 0]).unwrap();

    reset(&mut bench, RESET_COMMUNICATION);
    assert_eq!(bench.read(0x1017, 0), Ok(500_u16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(0x6100, 0), Ok(vec![5, 0]));
    reset(&mut bench, RESET_NODE);
    assert_eq!(bench.read(0x6100, 0), Ok(vec![4, 0]));
}

#[test]
fn a_default_cob_id_follows_the_node_id_and_another_one_does_not() {
    let mut bench = Bench::booted();
    bench.write32(0x1400, 1, 0x8000_0333).unwrap();
    save(&mut bench);
    let stored = std::mem::take(&mut bench.device.application_mut().stored);

    let mut bench = Bench::unconfigured();
    bench.device.application_mut().stored = stored;
    for request in [[4, 1, 0, 0, 0, 0, 0, 0], [0x11, ID + 1, 0, 0, 0, 0, 0, 0], [4, 0, 0, 0, 0, 0, 0, 0]] {
        bench.receive(canopen::Frame::new(0x7E5, &request).unwrap());
    }
    bench.start();
    assert_eq!(bench.device.node_id(), NodeId::new(ID + 1));
    let word = |index, sub| DICTIONARY.field(index, sub).u32(bench.device.image());
    assert_eq!((word(0x1014, 0), word(0x1800, 1), word(0x1400, 1)), (0x86, 0x186, 0x8000_0333));
}

/// Stores the COB-IDs of TPDO 1 and RPDO 1 and EMCY on node 5, and loads them on node 6.
fn moved(tpdo: u32, rpdo: u32, emcy: u32) -> [u32; 3] {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0000 | tpdo).unwrap();
    bench.write32(0x1800, 1, tpdo).unwrap();
    bench.write32(0x1400, 1, rpdo).unwrap();
    bench.write32(0x1014, 0, 0x8000_0000).unwrap();
    bench.write32(0x1014, 0, emcy).unwrap();
    save(&mut bench);
    let stored = std::mem::take(&mut bench.device.application_mut().stored);
    reset(&mut bench, RESET_COMMUNICATION);

    let mut bench = Bench::unconfigured();
    bench.device.application_mut().stored = stored;
    for request in [[4, 1, 0, 0, 0, 0, 0, 0], [0x11, ID + 1, 0, 0, 0, 0, 0, 0], [4, 0, 0, 0, 0, 0, 0, 0]] {
        bench.receive(canopen::Frame::new(0x7E5, &request).unwrap());
    }
    bench.start();
    [(0x1800, 1), (0x1400, 1), (0x1014, 0)]
        .map(|(index, sub)| DICTIONARY.field(index, sub).u32(bench.device.image()))
}

/// The flags in bits 30 and 31 do not matter: the CAN-ID alone decides.
#[test]
fn a_pre_defined_can_id_follows_the_node_id_with_any_flags() {
    for flags in [0, 0x4000_0000, 0x8000_0000, 0xC000_0000] {
        let [tpdo, rpdo, emcy] = moved(flags | 0x185, 0x8000_0205, 0x8000_0085);
        assert_eq!([tpdo, rpdo, emcy], [flags | 0x186, 0x8000_0206, 0x8000_0086], "{flags:X}h");
    }
    assert_eq!(moved(0x186, 0xC000_0206, 0x0000_0086), [0x186, 0xC000_0206, 0x86], "absolute");
    assert_eq!(moved(0x8000_0000, 0x8000_0000, 0x8000_0000), [0x8000_0000; 3], "absolute");
}

/// A firmware before 0.2 stored the CAN-ID with other flags as a number.
#[test]
fn a_cob_id_of_an_older_firmware_keeps_its_number() {
    let mut bench = Bench::booted();
    bench.device.application_mut().stored[0] = vec![0x00, 0x18, 1, 1, 4, 0x85, 0x01, 0x00, 0x40];
    reset(&mut bench, RESET_COMMUNICATION);
    assert_eq!(bench.read(0x1800, 1), Ok(vec![0x85, 0x01, 0x00, 0x40]));
    assert_eq!(bench.device.application().loaded.last(), Some(&(Group::Communication, true)));
}

#[test]
fn values_of_an_older_dictionary_fit_and_new_objects_have_their_defaults() {
    let mut bench = Bench::booted();
    // Data stored by a firmware that knew only 1017h.
    bench.device.application_mut().stored[0] = vec![0x17, 0x10, 0, 1, 2, 0xF4, 0x01];
    reset(&mut bench, RESET_COMMUNICATION);
    assert_eq!(bench.read(0x1017, 0), Ok(vec![0xF4, 0x01]));
    assert_eq!(bench.read(0x1029, 1), Ok(vec![0]));
    assert_eq!(bench.device.application().loaded.last(), Some(&(Group::Communication, true)));
}

#[test]
fn unfitting_stored_values_are_refused_as_a_whole_and_reported() {
    let good = [0x17, 0x10, 0, 1, 2, 0xF4, 0x01];
    let misfits: &[&[u8]] = &[
        &[0x18, 0x20, 0, 1, 2, 0, 0],             // no such object
        &[0x17, 0x10, 1, 1, 2, 0, 0],             // no such sub-index
        &[0x06, 0x10, 0, 1, 2, 0, 0],             // another size
        &[0x29, 0x10, 1, 1, 1, 255],              // above its limit
        &[0x00, 0x61, 0, 1, 2, 0, 0],             // object of another group
        &[0x00, 0x1A, 1, 1, 4, 8, 0, 0xFF, 0x67], // a mapping of an object that does not exist
        &[0x17, 0x10, 0],                         // cut
        &[0x17, 0x10, 0, 2, 2, 0, 0],             // cut
        &[0x17, 0x10, 0, 0, 2],                   // an empty run
        &[0x17, 0x10, 0, 5, 0],
    ];
    for misfit in misfits {
        let mut bench = Bench::booted();
        bench.device.application_mut().stored[0] = [&good[..], misfit].concat();
        bench.nmt(RESET_COMMUNICATION);
        bench.start();
        let emcy = bench.sent().into_iter().find(|(id, _)| *id == 0x085).expect("an EMCY");
        assert_eq!(emcy.1[..2], 0x6302_u16.to_le_bytes(), "{misfit:x?}");
        assert_eq!(bench.read(0x1017, 0), Ok(1000_u16.to_le_bytes().to_vec()), "{misfit:x?}");
        assert_eq!(bench.device.application().loaded.last(), Some(&(Group::Communication, false)));

        // After storing again, the next start is good.
        bench.device.application_mut().stored[0].clear();
        bench.nmt(RESET_COMMUNICATION);
        bench.start();
        assert!(bench.sent().iter().all(|(id, _)| *id != 0x085), "no fault is left");
        assert_eq!(bench.read(0x1001, 0), Ok(vec![0]));
    }
}

#[test]
fn a_memory_with_older_values_is_reported() {
    let mut bench = Bench::booted();
    bench.device.application_mut().is_damaged = true;
    bench.nmt(RESET_NODE);
    bench.start();
    let codes: Vec<_> =
        bench.sent().into_iter().filter(|(id, _)| *id == 0x085).map(|(_, d)| d[..2].to_vec()).collect();
    assert_eq!(codes, [0x6302_u16, 0x6303, 0x6300].map(u16::to_le_bytes));
}

#[test]
fn the_size_of_a_packed_group_is_known() {
    let bench = Bench::booted();
    let rows: Vec<_> = crate::bench::rows().map(|(row, _)| *row).collect();
    for group in [Group::Communication, Group::Application] {
        let relative = if group == Group::Communication { 4 * (5 + 4) } else { 0 };
        let packed = packed(&bench, group);
        assert_eq!(packed.len() + relative, packed_size(&rows, group));
    }
    let first = [Object::new(0x2000, 0, "", Type::Unsigned8, Access::ReadWrite).stored(Group::Application)];
    assert_eq!(packed_size(&first, Group::Application), 6, "the table begins with it");
}

#[test]
fn the_entries_of_a_packed_group_are_known() {
    let packed = packed(&Bench::booted(), Group::Communication);
    for (sub, is_there) in [(0, false), (1, true), (4, true), (5, false)] {
        assert_eq!(is_packed(&packed, 0x1016, sub), is_there, "{sub}");
    }
}

#[test]
fn a_setting_is_stored_at_once_and_shown_by_the_application() {
    let mut bench = Bench::booted();
    bench.take_action();
    assert_eq!(bench.write(0x5F00, 0, &[3]), Err(0x0609_0031));
    assert_eq!(bench.take_action(), None);
    assert_eq!(bench.ask_raw([0x2F, 0, 0x5F, 0, 2, 0, 0, 0]), None, "the response waits");
    assert_eq!(bench.take_action(), Some(Action::Store(Job::Setting(2))));
    assert_eq!(bench.read(0x5F00, 0), Ok(vec![0]), "it is not stored yet");
    assert_eq!(bench.ask_raw([0x2F, 0, 0x5F, 0, 2, 0, 0, 0]), None, "asked again");
    assert_eq!(finish(&mut bench, Ok(())), [0x60, 0, 0x5F, 0, 0, 0, 0, 0]);
}

/// The groups are loaded before the active faults are reported again.
#[test]
fn a_repaired_group_is_not_reported_at_the_next_reset() {
    for (command, is_lost) in
        [(RESET_COMMUNICATION, true), (RESET_COMMUNICATION, false), (RESET_NODE, true), (RESET_NODE, false)]
    {
        let mut bench = Bench::booted();
        let application = bench.device.application_mut();
        application.is_damaged = !is_lost;
        application.stored[0] = if is_lost { vec![1, 2, 3] } else { vec![] };
        bench.nmt(command);
        bench.start();
        assert!(bench.sent().iter().any(|(id, data)| *id == 0x085 && data[..2] == [0x02, 0x63]));
        bench.write(0x1029, 2, &[2]).unwrap();
        bench.write(0x1017, 0, &[0, 0]).unwrap();
        save(&mut bench);
        bench.device.application_mut().is_damaged = false;
        bench.nmt(command);
        bench.start();
        assert_eq!(bench.sent(), [(0x705, vec![0])], "the boot-up message alone");
        assert_eq!(bench.device.state(), State::PreOperational, "no error for 1029h");
        assert_eq!((bench.read(0x1001, 0), bench.read(0x1003, 0)), (Ok(vec![0]), Ok(vec![0])));
    }
}

#[test]
fn a_value_beyond_its_limits_is_stored_as_its_default() {
    let mut bench = Bench::booted();
    bench.write(0x6103, 0, b"kept").unwrap();
    bench.device.show(|_, image| {
        DICTIONARY.field(0x6100, 0).set_i16(image, 300);
        DICTIONARY.field(0x6101, 0).set_f32(image, f32::NAN);
        DICTIONARY.field(0x1029, 1).set_u8(image, 255);
    });
    save(&mut bench);
    bench.device.application_mut().loaded.clear();
    reset(&mut bench, RESET_NODE);
    assert_eq!(bench.device.application().loaded.iter().find(|(_, good)| !good), None);
    assert_eq!(bench.read(0x6103, 0), Ok(b"kept".to_vec()));
    assert_eq!((bench.read(0x6100, 0), bench.read(0x6101, 0)), (Ok(vec![0, 0]), Ok(vec![0; 4])));
    assert_eq!(bench.read(0x1029, 1), Ok(vec![0]));
}

#[test]
fn the_soundness_of_each_group_is_kept_apart() {
    for soundness in [Soundness::Whole, Soundness::Older, Soundness::Lost] {
        for group in Group::ALL {
            let mut damage = Damage::NONE;
            damage.set(group, soundness);
            for other in Group::ALL {
                let expected = if other == group { soundness } else { Soundness::Whole };
                assert_eq!(damage.of(other), expected, "{group:?}, {other:?}");
            }
            damage.set(group, Soundness::Whole);
            assert_eq!(damage, Damage::NONE);
        }
    }
}

#[test]
fn a_buffer_that_is_too_small_is_an_error_that_says_so() {
    let bench = Bench::booted();
    let whole = packed(&bench, Group::Application).len();
    for len in [0, 4, 5, whole - 1, whole] {
        let result =
            DICTIONARY.pack(Group::Application, NodeId::new(ID), bench.device.image(), &mut vec![0; len]);
        let message = result.map_err(|error| error.to_string());
        let expected = "the buffer has no room for all values of the group".to_owned();
        assert_eq!(message, if len == whole { Ok(whole) } else { Err(expected) }, "{len} bytes");
    }
}

/// RPDO 2 is not valid by default.
#[test]
fn a_pdo_that_was_stored_as_valid_stays_valid() {
    let mut bench = Bench::booted();
    bench.write32(0x1401, 1, 0x305).unwrap();
    save(&mut bench);
    reset(&mut bench, RESET_COMMUNICATION);
    assert_eq!(bench.read(0x1401, 1), Ok(vec![0x05, 0x03, 0, 0]));
}
