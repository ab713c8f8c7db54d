//! The personality of a node: object 2000h, stored at once and in force after the next reset.

use canopen::lss::Request as LssRequest;
use canopen::sdo::Abort;
use canopen::{Duration, Frame, Instant};
use host_tests::bench::{Bench, ID};
use node::{Action, Personality, StoreJob};

const RESET_COMMUNICATION: u8 = 0x82;
const VALUE_TOO_HIGH: u32 = 0x0609_0031;

fn device_type(bench: &mut Bench) -> u32 {
    u32::from_le_bytes(bench.read(0x1000, 0).unwrap().try_into().unwrap())
}

fn personality(bench: &mut Bench) -> u8 {
    bench.read(0x2000, 0).unwrap()[0]
}

#[test]
fn every_personality_leads_to_every_other_at_the_next_reset() {
    let types = [0x0002_0194, 0x0005_0196, 0xFFFF_0196, 0x0000_01A1];
    for from in Personality::ALL {
        for to in Personality::ALL {
            let mut bench = Bench::booted_as(from);
            bench.write(0x2000, 0, &[to.number()]).unwrap();
            assert_eq!(personality(&mut bench), to.number());
            assert_eq!(device_type(&mut bench), types[usize::from(from.number())], "not before a reset");
            let mut bench = bench.power_cycled();
            assert_eq!(device_type(&mut bench), types[usize::from(to.number())]);
            assert_eq!(personality(&mut bench), to.number());
        }
    }
}

#[test]
fn one_that_does_not_exist_is_refused() {
    let mut bench = Bench::booted();
    let beyond = u8::try_from(Personality::ALL.len()).unwrap();
    assert_eq!(bench.write(0x2000, 0, &[beyond]), Err(VALUE_TOO_HIGH));
    assert_eq!(personality(&mut bench), 0);
}

#[test]
fn a_reset_of_the_communication_restores_the_stored_values() {
    let mut bench = Bench::booted();
    bench.write(0x2000, 0, &[1]).unwrap();
    bench.nmt(0x82);
    bench.restart();
    assert_eq!((personality(&mut bench), device_type(&mut bench)), (1, 0x0002_0194));
}

/// Saved values and faults of one personality do not affect another one, and are present again after a return to it.
#[test]
fn each_personality_has_its_own_saved_parameters() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &500_u16.to_le_bytes()).unwrap();
    bench.write(0x6132, 1, &[2]).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    bench.write(0x2000, 0, &[1]).unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(0x1017, 0), Ok(1000_u16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(0x1001, 0), Ok(vec![0]));
    bench.write(0x2000, 0, &[0]).unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(0x1017, 0), Ok(500_u16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(0x6132, 1), Ok(vec![2]));
}

#[test]
fn node_id_and_personality_are_stored_together_and_change_alone() {
    let mut bench = Bench::booted();
    bench.write(0x2000, 0, &[2]).unwrap();
    let global = LssRequest::SwitchGlobal { configuration: true };
    let node_id = LssRequest::NodeId(ID);
    for request in [global, node_id, LssRequest::Store] {
        bench.receive(&canopen::Frame::new(0x7E5, &request.encode()).unwrap());
    }
    let mut bench = bench.power_cycled();
    assert_eq!(device_type(&mut bench), 0xFFFF_0196);
}

#[test]
fn a_failed_store_is_reported_and_changes_nothing() {
    let mut bench = Bench::booted();
    let now = Instant(1);
    // Written without the bench, which would store the value.
    let frame = canopen::Frame::new(0x600 + u16::from(ID), &[0x2F, 0, 0x20, 0, 1, 0, 0, 0]).unwrap();
    bench.overhear(&frame);
    let mut next = bench.protocol.on_service_frame(&frame, now, &mut bench.out);
    assert_eq!(bench.take(), [], "the answer waits");
    while !matches!(next.action, Some(Action::Store(_))) {
        next = bench.protocol.poll_services(now, &mut bench.out);
    }
    let mut job = StoreJob::new(Personality::default());
    assert!(bench.protocol.take_job(&mut job));
    let _ = bench.protocol.finish(&job, Err(Abort::Hardware), now, &mut bench.out);
    assert_eq!(bench.take(), [(0x580 + u16::from(ID), vec![0x80, 0, 0x20, 0, 0, 0, 6, 6])]);
    assert_eq!(personality(&mut bench), 0);
}

const NO_DATA: u32 = 0x0800_0024;

#[test]
fn the_transfer_buffer_of_every_personality_returns_the_data_of_a_download() {
    let data: Vec<u8> = (0..100).collect();
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        assert_eq!(bench.read(0x2F00, 0), Err(NO_DATA), "{personality:?}");
        bench.write(0x2F00, 0, &data).unwrap();
        assert_eq!(bench.read(0x2F00, 0), Ok(data.clone()), "{personality:?}");
    }
}

#[test]
fn the_transfer_buffer_takes_4096_bytes_and_refuses_more_before_it_forgets_them() {
    const TOO_LONG: u32 = 0x0607_0012;
    let data: Vec<u8> = (0..4096_u32).map(|number| number as u8).collect();
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        bench.write(0x2F00, 0, &data).unwrap();
        assert_eq!(bench.write(0x2F00, 0, &[0; 4097]), Err(TOO_LONG), "{personality:?}");
        assert!(bench.read(0x2F00, 0) == Ok(data.clone()), "{personality:?}");
    }
}

#[test]
fn a_download_that_ends_halfway_leaves_the_transfer_buffer_empty() {
    let data: Vec<u8> = (0..100).collect();
    let begin = [0x21, 0x00, 0x2F, 0, 100, 0, 0, 0];
    let segment = [0x00, 1, 2, 3, 4, 5, 6, 7];
    let begin_of_a_block = [0xC2, 0x00, 0x2F, 0, 100, 0, 0, 0];
    let segment_of_a_block = [0x01, 1, 2, 3, 4, 5, 6, 7];
    let abort = [0x80, 0x00, 0x2F, 0, 0, 0, 0x04, 0x05];
    for personality in Personality::ALL {
        for (begin, segment) in [(begin, segment), (begin_of_a_block, segment_of_a_block)] {
            for end in ["abort", "reset of the communication", "a new download"] {
                let case = format!("{personality:?}, {:02X}h, {end}", begin[0]);
                let mut bench = Bench::booted_as(personality);
                bench.write(0x2F00, 0, &data).unwrap();
                let request = |bench: &mut Bench, bytes: [u8; 8]| {
                    bench.receive(&Frame::new(0x600 + bench.id(), &bytes).unwrap());
                };
                request(&mut bench, begin);
                request(&mut bench, segment);
                match end {
                    "abort" => request(&mut bench, abort),
                    "a new download" => {
                        request(&mut bench, begin);
                        request(&mut bench, abort);
                    }
                    _ => {
                        bench.nmt(RESET_COMMUNICATION);
                        bench.restart();
                    }
                }
                bench.now = bench.now + Duration::from_millis(200);
                bench.poll();
                bench.take();
                assert_eq!(bench.read(0x2F00, 0), Err(NO_DATA), "{case}");
                bench.write(0x2F00, 0, &data).unwrap();
                assert_eq!(bench.read(0x2F00, 0), Ok(data.clone()), "{case}");
            }
        }
    }
}
