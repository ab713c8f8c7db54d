//! Errors of every personality and several node-IDs: the EMCY, then the state that 1029h demands.

use canopen::Frame;
use host_tests::bench::{Bench, raw};
use node::fault::{PARAMETER_STORE, UNEXPECTED_RESET};
use node::{BusEvent, Personality, State};
use profiles::board::RawSample;
use profiles::lift::devices::Devices;

const NODE_IDS: [u8; 3] = [1, 16, 127];
const START: u8 = 0x01;
const PRE_OPERATIONAL: u8 = 0x80;
const RESET_COMMUNICATION: u8 = 0x82;
/// 1029h: the state that follows in a node that is Operational.
const BEHAVIOURS: [(u8, State); 3] =
    [(0, State::PreOperational), (1, State::Operational), (2, State::Stopped)];

/// All personalities with several node-IDs.
fn nodes() -> impl Iterator<Item = (Personality, u8)> {
    Personality::ALL.into_iter().flat_map(|personality| NODE_IDS.map(|id| (personality, id)))
}

fn intact() -> RawSample {
    raw(250_000.0, 298.15)
}

/// A node that measures without faults; a lift node is all virtual devices.
fn measuring(personality: Personality, id: u8) -> Bench {
    let mut bench = Bench::booted_at(personality, id);
    if personality == Personality::Lift {
        bench.write(0x2305, 0, &[Devices::ALL.0]).unwrap();
    }
    (0..20).for_each(|_| bench.sample(&intact()));
    bench.take();
    bench
}

fn operational(personality: Personality, id: u8, behaviour: u8) -> Bench {
    let mut bench = measuring(personality, id);
    bench.write(0x1017, 0, &20_u16.to_le_bytes()).unwrap();
    (1..=2).for_each(|sub| bench.write(0x1029, sub, &[behaviour]).unwrap());
    bench.nmt(START);
    (0..20).for_each(|_| bench.sample(&intact()));
    bench.take();
    bench
}

/// A message about errors or the state.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Report {
    Emcy(u16),
    State(u8),
}

/// The EMCYs and the changes of the reported state since the last call.
fn reports(bench: &mut Bench) -> Vec<Report> {
    let id = bench.id();
    let report = |(frame, data): (u16, Vec<u8>)| match frame - id {
        0x080 => Some(Report::Emcy(u16::from_le_bytes([data[0], data[1]]))),
        0x700 => Some(Report::State(data[0])),
        _ => None,
    };
    let frames = bench.take().into_iter().filter(|(frame, _)| *frame >= 0x080 + id);
    let mut reports: Vec<_> = frames.filter_map(report).collect();
    reports.dedup();
    reports
}

/// Lets a millisecond pass, with or without a fault of the sensor board.
fn sample(bench: &mut Bench, is_faulty: bool) {
    bench.encoder.board.memory_error = is_faulty;
    let pressure = if is_faulty { 0 } else { intact().pressure };
    bench.sample(&RawSample { pressure, ..intact() });
}

#[test]
fn the_emcy_of_a_fault_precedes_the_state_of_1029h() {
    for (personality, id) in nodes() {
        for (behaviour, state) in BEHAVIOURS {
            let context = format!("{personality:?} {id}, 1029h:2 = {behaviour}");
            let mut bench = operational(personality, id, behaviour);
            bench.set_fault(PARAMETER_STORE, true);
            assert_eq!(reports(&mut bench), [Report::Emcy(0x5003)], "{context}");
            (0..30).for_each(|_| bench.sample(&intact()));
            assert_eq!(reports(&mut bench), [Report::State(state.code())], "{context}");

            let mut bench = operational(personality, id, behaviour);
            (0..1000).for_each(|_| sample(&mut bench, true));
            let reports = reports(&mut bench);
            let first = reports.iter().position(|report| matches!(report, Report::Emcy(_)));
            let change = reports.iter().position(|report| *report == Report::State(state.code()));
            let is_ordered = behaviour == 1 || first < change;
            assert!(first.is_some() && is_ordered, "{context}: {reports:?}");
            assert_eq!(bench.protocol.state(), state, "{context}");
        }
    }
}

#[test]
fn a_lost_heartbeat_is_reported_before_the_state_changes() {
    for (personality, id) in nodes() {
        for (behaviour, state) in BEHAVIOURS {
            let context = format!("{personality:?} {id}, 1029h:1 = {behaviour}");
            let mut bench = operational(personality, id, behaviour);
            bench.write(0x1016, 1, &0x0009_0014_u32.to_le_bytes()).unwrap();
            bench.receive(&Frame::new(0x709, &[5]).unwrap());
            bench.take();
            (0..60).for_each(|_| bench.sample(&intact()));
            let reports = reports(&mut bench);
            let expected = [Report::Emcy(0x8130), Report::State(state.code())];
            assert!(reports.ends_with(&expected), "{context}: {reports:X?}");
            assert!(reports.len() <= 3, "{context}: {reports:X?}");
        }
    }
}

#[test]
fn a_recovery_from_bus_off_is_reported_before_the_node_stops() {
    for (personality, id) in nodes() {
        let mut bench = operational(personality, id, 2);
        bench.bus_event(BusEvent::BusOff);
        assert_eq!(bench.protocol.state(), State::PreOperational, "{personality:?} {id}");
        bench.bus_event(BusEvent::Recovered);
        (0..40).for_each(|_| bench.sample(&intact()));
        let mut reports = reports(&mut bench);
        reports.retain(|report| *report != Report::State(State::PreOperational.code()));
        assert_eq!(reports[0], Report::Emcy(0x8140), "{personality:?} {id}");
        assert_eq!(reports.last(), Some(&Report::State(4)), "{personality:?} {id}");
    }
}

/// A damaged set, a fault that the firmware finds, and a sensor that is broken from the beginning.
#[test]
fn errors_that_the_start_finds_are_reported_and_then_1029h_is_applied() {
    for (personality, id) in nodes() {
        for behaviour in [0, 1, 2] {
            let context = format!("{personality:?} {id}, 1029h:2 = {behaviour}");
            let state = if behaviour == 2 { State::Stopped } else { State::PreOperational };
            let mut bench = measuring(personality, id);
            bench.write(0x1029, 2, &[behaviour]).unwrap();
            bench.write(0x1F80, 0, &[8, 0, 0, 0]).unwrap();
            bench.write(0x1010, 1, b"save").unwrap();
            bench.write(0x2002, 3, &[1, 2]).unwrap();
            bench.write(0x1010, 3, b"save").unwrap();
            let mut bench = bench.power_cycled_with_damage();
            bench.nmt(RESET_COMMUNICATION);
            for _ in 0..2 {
                bench.restart();
                bench.sample(&intact());
                assert_eq!(reports(&mut bench), [Report::State(0), Report::Emcy(0x6303)], "{context}");
                assert_eq!(bench.protocol.state(), state, "{context}");
            }

            bench.set_fault(UNEXPECTED_RESET, true);
            (0..1000).for_each(|_| sample(&mut bench, true));
            bench.nmt(PRE_OPERATIONAL);
            let mut before = reports(&mut bench);
            before.retain(|report| matches!(report, Report::Emcy(_)));
            bench.restart();
            sample(&mut bench, true);
            let again = reports(&mut bench);
            assert!(again.len() >= 3, "{context}: {again:?}");
            assert!(before.iter().all(|emcy| again.contains(emcy)), "{context}: {before:?} {again:?}");
            assert_eq!(bench.protocol.state(), state, "{context}");
        }
    }
}

/// A wire that touches a rail 125 times a second, and a memory that fails as often.
#[test]
fn a_loose_contact_is_one_fault() {
    for (personality, id) in nodes() {
        let mut bench = operational(personality, id, 1);
        bench.write(0x1003, 0, &[0]).unwrap();
        bench.take();
        for millisecond in 0..2000 {
            sample(&mut bench, millisecond % 8 == 0);
        }
        let emcys = reports(&mut bench).iter().filter(|report| matches!(report, Report::Emcy(_))).count();
        let listed = usize::from(bench.read(0x1003, 0).unwrap()[0]);
        assert!(emcys <= 6 && listed <= emcys, "{personality:?} {id}: {emcys} EMCYs, {listed} in 1003h");
        (0..1200).for_each(|_| bench.sample(&intact()));
        assert_eq!(bench.read(0x1001, 0), Ok(vec![0]), "{personality:?} {id}");
    }
}

#[test]
fn the_list_has_exactly_the_errors_that_were_sent() {
    for (personality, id) in nodes() {
        let mut bench = measuring(personality, id);
        let cob_id = 0x80 + u32::from(id);
        bench.write(0x1014, 0, &(0x8000_0000 | cob_id).to_le_bytes()).unwrap();
        bench.set_fault(PARAMETER_STORE, true);
        bench.sample(&intact());
        assert_eq!(bench.read(0x1003, 0), Ok(vec![0]), "{personality:?} {id}");
        bench.write(0x1015, 0, &10_000_u16.to_le_bytes()).unwrap();
        bench.write(0x1014, 0, &cob_id.to_le_bytes()).unwrap();
        bench.set_fault(UNEXPECTED_RESET, true);
        let mut sent = vec![];
        for _ in 0..2500 {
            bench.sample(&intact());
            sent.extend(reports(&mut bench).into_iter().filter_map(|report| match report {
                Report::Emcy(code) => Some(code),
                Report::State(_) => None,
            }));
            let count = bench.read(0x1003, 0).unwrap()[0];
            let listed = (1..=count).map(|sub| bench.read(0x1003, sub).unwrap());
            let listed: Vec<_> = listed.map(|entry| u16::from_le_bytes([entry[0], entry[1]])).collect();
            assert!(listed.iter().eq(sent.iter().rev()), "{personality:?} {id}: {listed:X?}, sent {sent:X?}");
        }
        assert_eq!(sent, [0x5003, 0x6101], "{personality:?} {id}");
    }
}
