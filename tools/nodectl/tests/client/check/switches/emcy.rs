//! Faults of EMCY and SYNC.

use canopen::nmt::State;

use super::super::faulty::{Way, frame};
use super::super::layers::{EMCY, HEARTBEAT, babbles, loses, reads, sends_otherwise, swallows, uploads};
use super::{Switch, fault};

const ANY: &[State] = &[State::PreOperational, State::Operational, State::Stopped];

pub(super) fn switches() -> Vec<Switch> {
    [objects(), messages(), list(), sync()].into_iter().flatten().collect()
}

fn objects() -> Vec<Switch> {
    vec![
        fault("has another CAN-ID in 1014h", &["EMC-01"], reads(0x1014, 0, &[0x81, 0, 0, 0])),
        fault("has two bytes in 1001h", &["EMC-02"], reads(0x1001, 0, &[0, 0])),
        fault("has an error in 1001h and none in 1003h", &["EMC-03", "EMC-23"], reads(0x1001, 0, &[1])),
        fault(
            "takes any 1014h and does not follow",
            &["EMC-04", "EMC-05", "EMC-06", "EMC-07"],
            swallows(0x1014, 0),
        ),
        fault("does not keep its inhibit time of EMCY", &["EMC-08"], swallows(0x1015, 0)),
        fault("does not set the generic error", &["EMC-09", "EMC-23"], reads(0x1001, 0, &[0x10])),
    ]
}

fn messages() -> Vec<Switch> {
    let mut register = false;
    vec![
        fault(
            "tells another code",
            &["EMC-20", "ERR-22"],
            sends_otherwise(EMCY, |data, _| {
                if data[0] == 0x30 { [&[0x00, 0x10], &data[2..]].concat() } else { data.to_vec() }
            }),
        ),
        fault(
            "tells each error twice",
            &["EMC-21", "EMC-27"],
            Box::new(|look| {
                if look.is(Way::Out, EMCY) {
                    look.to_bus.push(look.frame);
                }
            }),
        ),
        fault(
            "sends an EMCY of seven bytes",
            &["EMC-22"],
            sends_otherwise(EMCY, |data, _| data[..7].to_vec()),
        ),
        fault(
            "sends an EMCY without error register",
            &["EMC-23"],
            sends_otherwise(EMCY, |data, _| [&data[..2], &[0], &data[3..]].concat()),
        ),
        fault(
            "does not tell the end of an error",
            &["EMC-24"],
            loses(|look| look.is(Way::Out, EMCY) && look.frame.data().starts_with(&[0, 0])),
        ),
        fault(
            "keeps an error in 1001h",
            &["EMC-25"],
            Box::new(move |look| {
                register |= look.is(Way::Out, EMCY);
                if register && uploads(look, (0x1001, 0)) {
                    look.answer([0x4F, 0x01, 0x10, 0, 0x11, 0, 0, 0]);
                }
            }),
        ),
        fault(
            "sends EMCY in Stopped",
            &["EMC-26"],
            babbles(100, &[State::Stopped], frame(EMCY, &[0, 0x10, 1, 0, 0, 0, 0, 0])),
        ),
        fault(
            "sends an EMCY when it boots",
            &["EMC-28"],
            Box::new(|look| {
                if look.is(Way::Out, HEARTBEAT) && look.frame.data() == [0] {
                    look.later.push((50, frame(EMCY, &[0, 0x10, 1, 0, 0, 0, 0, 0])));
                }
            }),
        ),
    ]
}

fn list() -> Vec<Switch> {
    vec![
        fault("shows entries that are not there", &["EMC-40"], reads(0x1003, 1, &[0, 0, 0, 0])),
        fault("has another code in 1003h:1", &["EMC-41"], reads(0x1003, 1, &[0, 0x10, 0, 0])),
        fault("does not empty 1003h", &["EMC-42", "EMC-43"], swallows(0x1003, 0)),
        fault("does not count its errors", &["EMC-44"], reads(0x1003, 0, &[0])),
        fault(
            "loses older errors",
            &["EMC-45"],
            Box::new(|look| {
                if (2..=4).any(|sub| uploads(look, (0x1003, sub))) {
                    let sub = look.frame.data()[3];
                    look.answer([0x43, 0x03, 0x10, sub, 0, 0, 0, 0]);
                }
            }),
        ),
        fault("takes a write to 1003h:1", &["EMC-46"], swallows(0x1003, 1)),
    ]
}

fn sync() -> Vec<Switch> {
    vec![
        fault("has another CAN-ID in 1005h", &["SYN-01"], reads(0x1005, 0, &[0x81, 0, 0, 0])),
        fault("takes any 1005h and does not follow", &["SYN-02", "SYN-03", "SYN-11"], swallows(0x1005, 0)),
        fault(
            "takes any 1019h and does not follow",
            &["SYN-04", "SYN-05", "SYN-06", "SYN-07", "SYN-08"],
            swallows(0x1019, 0),
        ),
        fault("does not keep its period", &["SYN-09"], swallows(0x1006, 0)),
        fault("does not keep its window", &["SYN-10"], swallows(0x1007, 0)),
        fault(
            "is a producer that sends no SYNC",
            &["SYN-20", "SYN-22", "SYN-23"],
            loses(|look| look.is(Way::Out, 0x80)),
        ),
        fault(
            "never stops sending SYNC",
            &["SYN-21", "SYN-24", "SYN-25"],
            babbles(100, ANY, frame(0x80, &[])),
        ),
        fault("sends data in each SYNC", &["SYN-22"], sends_otherwise(0x80, |_, _| vec![1])),
        fault(
            "does not count its SYNC",
            &["SYN-23"],
            sends_otherwise(0x80, |data, _| if data.is_empty() { vec![] } else { vec![1] }),
        ),
    ]
}
