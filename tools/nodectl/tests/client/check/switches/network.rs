//! Faults of NMT and error control.

use canopen::nmt::State;

use super::super::device::ID;
use super::super::faulty::{Layer, Way, frame};
use super::super::layers::{
    EMCY, HEARTBEAT, REQUEST, TPDO, babbles, command, hears, is_command, is_late, lacks, loses, reads,
    replies, sends_otherwise, swallows, uploads,
};
use super::{Switch, fault};

const ANY: &[State] = &[State::PreOperational, State::Operational, State::Stopped];

pub(super) fn switches() -> Vec<Switch> {
    [boot(), states(), addressing(), heartbeat(), consumer(), guarding()].into_iter().flatten().collect()
}

/// Whether a frame is the boot-up message.
fn is_boot_up(look: &super::super::faulty::Look) -> bool {
    look.is(Way::Out, HEARTBEAT) && look.frame.data() == [0]
}

fn boot() -> Vec<Switch> {
    let mut booted = canopen::Instant(0);
    vec![
        fault(
            "boots twice",
            &["NMT-01", "NMT-02", "NMT-03", "NMT-04", "NMT-05", "NMT-06"],
            Box::new(|look| {
                if is_boot_up(look) {
                    look.to_bus.push(look.frame);
                }
            }),
        ),
        fault(
            "starts by itself",
            &["NMT-07", "NMT-08"],
            Box::new(|look| {
                if is_boot_up(look) {
                    look.to_device.push(command(1));
                }
            }),
        ),
        fault(
            "sends a PDO before it has booted",
            &["NMT-09"],
            replies(|look| is_command(look, 0x81).then(|| frame(TPDO, &[0, 0]))),
        ),
        fault(
            "is deaf to SDO after it has booted",
            &["NMT-11"],
            Box::new(move |look| {
                if is_boot_up(look) {
                    booted = look.now;
                }
                if look.is(Way::In, REQUEST) && booted.0 > 0 && look.now.0 - booted.0 < 400_000 {
                    look.pass = None;
                }
            }),
        ),
        fault("takes long to boot", &["NMT-12"], {
            let mut late = is_late(HEARTBEAT, 7000);
            Box::new(move |look| {
                if is_boot_up(look) {
                    late(look);
                }
            })
        }),
    ]
}

/// Ignores an NMT command in a state.
fn ignores(specifier: u8, state: State) -> Layer {
    loses(move |look| is_command(look, specifier) && look.state == state)
}

fn states() -> Vec<Switch> {
    let mut asked = 0;
    vec![
        fault("does not start from Pre-operational", &["NMT-20"], ignores(1, State::PreOperational)),
        fault("does not start from Stopped", &["NMT-21"], ignores(1, State::Stopped)),
        fault("does not stop from Pre-operational", &["NMT-22"], ignores(2, State::PreOperational)),
        fault("does not stop from Operational", &["NMT-23"], ignores(2, State::Operational)),
        fault(
            "does not leave Operational for Pre-operational",
            &["NMT-24"],
            ignores(0x80, State::Operational),
        ),
        fault("does not leave Stopped for Pre-operational", &["NMT-25"], ignores(0x80, State::Stopped)),
        fault(
            "answers no more than three times in Pre-operational",
            &["NMT-26", "ROB-44"],
            Box::new(move |look| {
                if uploads(look, (0x1000, 0)) && look.state == State::PreOperational {
                    asked += 1;
                    if asked > 3 {
                        look.pass = None;
                    }
                }
            }),
        ),
        fault(
            "answers no SDO in Operational",
            &["NMT-27"],
            loses(|look| look.is(Way::In, REQUEST) && look.state == State::Operational),
        ),
        fault(
            "answers SDO in Stopped",
            &["NMT-28"],
            Box::new(|look| {
                if look.state == State::Stopped && uploads(look, (0x1000, 0)) {
                    look.answer([0x43, 0x00, 0x10, 0, 0, 0, 0, 0]);
                }
            }),
        ),
        fault(
            "boots when it is started again",
            &["NMT-29"],
            replies(|look| {
                (is_command(look, 1) && look.state == State::Operational).then(|| frame(HEARTBEAT, &[0]))
            }),
        ),
        fault(
            "sends no TPDO",
            &["NMT-30", "PDO-21", "PDO-22", "PDO-23", "PDO-24"],
            loses(|look| look.is(Way::Out, TPDO)),
        ),
    ]
}

fn addressing() -> Vec<Switch> {
    let mut last = canopen::Instant(0);
    let obeys = |is_meant: fn(&[u8]) -> bool| {
        hears(move |look| (look.frame.id() == 0 && is_meant(look.frame.data())).then(|| command(1)))
    };
    vec![
        fault(
            "does not obey a command to all",
            &["NMT-40"],
            loses(|look| look.is(Way::In, 0) && look.frame.data().get(1) == Some(&0)),
        ),
        fault(
            "obeys commands to others",
            &["NMT-41", "ROB-41"],
            hears(|look| {
                (look.is(Way::In, 0) && look.frame.len() == 2).then(|| command(look.frame.data()[0]))
            }),
        ),
        fault("starts with an unknown command", &["NMT-42"], obeys(|data| matches!(data, [0x7F, ID]))),
        fault("obeys a command of one byte", &["NMT-43"], obeys(|data| data == [1])),
        fault("obeys a command of three bytes", &["NMT-44", "ROB-25"], obeys(|data| data.len() == 3)),
        fault(
            "obeys a remote frame",
            &["NMT-45"],
            hears(|look| (look.frame.id() == 0 && look.frame.is_remote()).then(|| command(1))),
        ),
        fault(
            "misses commands in a row",
            &["NMT-46", "ROB-45"],
            Box::new(move |look| {
                if look.is(Way::In, 0) {
                    if look.now.0 - last.0 < 1000 {
                        look.pass = None;
                    }
                    last = look.now;
                }
            }),
        ),
    ]
}

fn heartbeat() -> Vec<Switch> {
    let (mut count, mut jitter, mut silent) = (0_u32, 0_u32, canopen::Instant(0));
    let says = |from: u8, to: u8| {
        sends_otherwise(HEARTBEAT, move |data, _| if data == [from] { vec![to] } else { data.to_vec() })
    };
    vec![
        fault(
            "sends every other heartbeat",
            &["ERR-02"],
            Box::new(move |look| {
                if look.is(Way::Out, HEARTBEAT) && look.frame.data() != [0] {
                    count += 1;
                    if count % 2 == 0 {
                        look.pass = None;
                    }
                }
            }),
        ),
        fault(
            "sends heartbeats when there are none to be",
            &["ERR-03"],
            babbles(100, ANY, frame(HEARTBEAT, &[0x7F])),
        ),
        fault("says Operational in Pre-operational", &["ERR-04", "NMT-07"], says(0x7F, 0x05)),
        fault("says Pre-operational in Operational", &["ERR-05", "NMT-20"], says(0x05, 0x7F)),
        fault("says Operational in Stopped", &["ERR-06", "NMT-22"], says(0x04, 0x05)),
        fault(
            "sends heartbeats of two bytes",
            &["ERR-07"],
            sends_otherwise(HEARTBEAT, |data, _| if data == [0] { vec![0] } else { vec![data[0], 0] }),
        ),
        fault(
            "sends heartbeats unevenly",
            &["ERR-08"],
            Box::new(move |look| {
                if look.is(Way::Out, HEARTBEAT) && look.frame.data() != [0] {
                    jitter += 1;
                    if jitter % 2 == 0 {
                        look.later.push((30, look.frame));
                        look.pass = None;
                    }
                }
            }),
        ),
        fault(
            "is slow to take a new heartbeat time",
            &["ERR-09"],
            Box::new(move |look| {
                if super::super::layers::downloads(look, (0x1017, 0)).is_some() {
                    silent = look.now;
                }
                if look.is(Way::Out, HEARTBEAT)
                    && look.now.0 - silent.0 < 400_000
                    && silent.0 > 0
                    && look.frame.data() != [0]
                {
                    look.pass = None;
                }
            }),
        ),
        fault(
            "sends no heartbeat in Operational",
            &["ERR-10", "ERR-05"],
            loses(|look| look.is(Way::Out, HEARTBEAT) && look.state == State::Operational),
        ),
        fault("has neither heartbeat nor guarding", &["ERR-11"], lacks(&[0x1017, 0x100C])),
        fault("does not take a heartbeat time of 0", &["ERR-01", "ERR-03"], zero_is_one_second()),
    ]
}

/// Changes a write of 0 to 1017h into a write of 100.
fn zero_is_one_second() -> Layer {
    hears(|look| {
        let data = super::super::layers::downloads(look, (0x1017, 0)).filter(|data| data[4..6] == [0, 0])?;
        Some(frame(REQUEST, &[data[0], 0x17, 0x10, 0, 100, 0, 0, 0]))
    })
}

fn consumer() -> Vec<Switch> {
    const LOST: [u8; 8] = [0x30, 0x81, 0x11, 0, 0, 0, 0, 0];
    let mut told = 0;
    let mut commanded = State::PreOperational.code();
    vec![
        fault("watches one node twice", &["ERR-20"], swallows(0x1016, 2)),
        fault(
            "misses heartbeats that come",
            &["ERR-21"],
            replies(|look| (look.is(Way::In, 0x770) && look.frame.data() != [0]).then(|| frame(EMCY, &LOST))),
        ),
        fault(
            "does not tell a lost heartbeat",
            &["ERR-22", "ERR-26", "ERR-47", "EMC-20"],
            loses(|look| look.is(Way::Out, EMCY) && look.frame.data().starts_with(&LOST[..2])),
        ),
        fault(
            "stays as it is without heartbeat",
            &["ERR-23", "ERR-25"],
            Box::new(move |look| {
                if look.is(Way::In, 0) && look.frame.data().get(1) == Some(&ID) {
                    commanded = match look.frame.data()[0] {
                        1 => 0x05,
                        2 => 0x04,
                        _ => 0x7F,
                    };
                }
                if look.is(Way::Out, HEARTBEAT) && look.frame.data() != [0] {
                    look.replace(&[commanded]);
                }
            }),
        ),
        fault(
            "goes to Pre-operational although 1029h says stay",
            &["ERR-24"],
            Box::new(|look| {
                if look.is(Way::Out, EMCY) && look.frame.data().starts_with(&LOST[..2]) {
                    look.to_device.push(command(0x80));
                }
            }),
        ),
        fault(
            "tells a lost heartbeat once",
            &["ERR-26"],
            Box::new(move |look| {
                if look.is(Way::Out, EMCY) && look.frame.data().starts_with(&LOST[..2]) {
                    told += 1;
                    if told > 1 {
                        look.pass = None;
                    }
                }
            }),
        ),
        fault(
            "misses whom it has never heard",
            &["ERR-27", "ERR-28", "ERR-29"],
            Box::new(|look| {
                if super::super::layers::downloads(look, (0x1016, 1)).is_some() {
                    look.later.push((300, frame(EMCY, &LOST)));
                }
            }),
        ),
        fault("has two bytes in 1016h:1", &["ERR-30"], reads(0x1016, 1, &[0, 0])),
    ]
}

fn guarding() -> Vec<Switch> {
    let mut has_beaten = false;
    let is_guarded = |look: &super::super::faulty::Look| {
        look.way == Way::In && look.frame.id() == HEARTBEAT && look.frame.is_remote()
    };
    vec![
        fault("has a guard time and no life time factor", &["ERR-40"], lacks(&[0x100D])),
        fault(
            "does not toggle when it is guarded",
            &["ERR-41", "ERR-42", "ERR-43"],
            sends_otherwise(HEARTBEAT, |data, _| vec![data[0] & 0x7F]),
        ),
        fault(
            "begins with toggle bit 1",
            &["ERR-44"],
            sends_otherwise(HEARTBEAT, |data, _| vec![if data == [0] { 0 } else { data[0] ^ 0x80 }]),
        ),
        fault(
            "answers guarding of others",
            &["ERR-45"],
            replies(|look| {
                let is_other = matches!(look.frame.id(), 0x701..=0x77F) && look.frame.id() != HEARTBEAT;
                (is_other && look.frame.is_remote()).then(|| frame(look.frame.id(), &[0x7F]))
            }),
        ),
        fault("keeps its guard time", &["ERR-46", "ERR-47"], swallows(0x100C, 0)),
        fault(
            "answers guarding while it sends heartbeats",
            &["ERR-48", "ERR-49", "ERR-50"],
            replies(move |look| is_guarded(look).then(|| frame(HEARTBEAT, &[look.state.code()]))),
        ),
        fault(
            "is never guarded again after a heartbeat",
            &["ERR-51"],
            Box::new(move |look| {
                has_beaten |= super::super::layers::downloads(look, (0x1017, 0))
                    .is_some_and(|data| data[4..6] != [0, 0]);
                if has_beaten && is_guarded(look) {
                    look.pass = None;
                }
            }),
        ),
    ]
}
