//! Devices that fail under foreign traffic, nonsense and floods.

use canopen::Instant;
use canopen::nmt::State;

use super::super::faulty::{Look, Way, frame};
use super::super::layers::{
    EMCY, HEARTBEAT, REQUEST, RESPONSE, RPDO, TPDO, babbles, command, dies, hears, loses, place, replies,
    uploads,
};
use super::{Switch, fault};

pub(super) fn switches() -> Vec<Switch> {
    [foreign(), nonsense(), floods()].into_iter().flatten().collect()
}

fn foreign() -> Vec<Switch> {
    let mut confused = false;
    vec![
        fault(
            "answers the SDO requests of others",
            &["ROB-01"],
            replies(|look| {
                let is_other = matches!(look.frame.id(), 0x601..=0x67F) && look.frame.id() != REQUEST;
                is_other.then(|| frame(look.frame.id() - 0x80, &[0x43, 0x00, 0x10, 0, 0, 0, 0, 0]))
            }),
        ),
        fault(
            "sends a CAN-ID of nobody",
            &["ROB-02"],
            babbles(100, &[State::Operational], frame(0x3FF, &[1])),
        ),
        fault(
            "takes the response of another for its own",
            &["ROB-03"],
            Box::new(move |look| {
                confused |= look.way == Way::In && matches!(look.frame.id(), 0x581..=0x5FF);
                if confused && uploads(look, (0x1018, 1)) {
                    look.answer([0x43, 0x18, 0x10, 1, 9, 9, 9, 9]);
                }
            }),
        ),
        fault(
            "passes on the EMCY of others",
            &["ROB-04"],
            replies(|look| {
                let is_other = matches!(look.frame.id(), 0x081..=0x0FF) && look.frame.id() != EMCY;
                is_other.then(|| frame(EMCY, look.frame.data()))
            }),
        ),
        fault("stops with TIME", &["ROB-05"], hears(|look| (look.frame.id() == 0x100).then(|| command(2)))),
        fault(
            "answers LSS requests for others",
            &["ROB-06"],
            replies(|look| {
                (look.frame.id() == 0x7E5 && look.frame.data().first() == Some(&0x11))
                    .then(|| frame(0x7E4, &[0x11, 0, 0, 0, 0, 0, 0, 0]))
            }),
        ),
    ]
}

fn nonsense() -> Vec<Switch> {
    let mut alone: Option<Instant> = None;
    vec![
        fault(
            "dies of a short SDO request",
            &["ROB-20"],
            dies(|look| look.is(Way::In, REQUEST) && look.frame.len() < 8),
        ),
        fault(
            "answers a remote frame for SDO",
            &["ROB-21"],
            replies(|look| {
                (look.frame.id() == REQUEST && look.frame.is_remote())
                    .then(|| frame(RESPONSE, &[0x80, 0, 0, 0, 1, 0, 4, 5]))
            }),
        ),
        fault(
            "dies of an unknown command",
            &["ROB-22", "SDO-09"],
            dies(|look| look.request().is_some_and(|data| data[0] >> 5 == 7)),
        ),
        fault(
            "takes nonsense for a heartbeat time",
            &["ROB-23"],
            hears(|look| {
                let data = look.request().filter(|data| data[0] >> 5 == 1 && place(*data).0 < 0x100)?;
                Some(frame(REQUEST, &[0x2B, 0x17, 0x10, 0, data[4], 0x77, 0, 0]))
            }),
        ),
        fault(
            "dies of a short LSS request",
            &["ROB-24"],
            dies(|look| look.is(Way::In, 0x7E5) && look.frame.len() < 8),
        ),
        fault(
            "dies of a long NMT command",
            &["ROB-25"],
            dies(|look| look.is(Way::In, 0) && look.frame.len() > 3),
        ),
        fault(
            "dies of a long SYNC",
            &["ROB-26"],
            dies(|look| look.is(Way::In, 0x80) && look.frame.len() > 1),
        ),
        fault(
            "waits for ever for a client",
            &["ROB-27"],
            Box::new(move |look| {
                if let Some(data) = look.request() {
                    if let Some(since) = alone.filter(|since| look.now.0 - since.0 > 1_000_000) {
                        look.pass = None;
                        alone = Some(since);
                        return;
                    }
                    alone = (data[0] == 0x21).then_some(look.now);
                }
            }),
        ),
        fault(
            "dies of a long RPDO",
            &["ROB-28"],
            dies(|look| look.is(Way::In, RPDO) && look.frame.len() > 2),
        ),
    ]
}

/// Whether more than `most` frames of a kind have come without a gap.
fn flood(most: u32, is_meant: impl Fn(&Look) -> bool) -> impl FnMut(&Look) -> bool {
    let (mut count, mut last) = (0, Instant(0));
    move |look| {
        if look.way != Way::In || !is_meant(look) {
            return false;
        }
        // Without a gap means less than one and a half frame times. A client that waits for answers leaves longer gaps.
        count = if look.now.0 - last.0 < 696 { count + 1 } else { 1 };
        last = look.now;
        count > most
    }
}

fn floods() -> Vec<Switch> {
    let (mut requests, mut syncs) = (0, Instant(0));
    vec![
        fault("dies of 400 SYNC", &["ROB-40"], dies(flood(400, |look| look.is(Way::In, 0x80)))),
        fault("starts with the 400th command for others", &["ROB-41"], {
            let mut floods = flood(400, |look| look.is(Way::In, 0));
            Box::new(move |look| {
                if floods(look) {
                    look.pass = Some(command(1));
                }
            })
        }),
        fault(
            "dies of ten requests in a row",
            &["ROB-42"],
            dies(flood(10, |look| look.is(Way::In, REQUEST))),
        ),
        fault(
            "has no time for a heartbeat in a flood",
            &["ROB-43"],
            Box::new(move |look| {
                if look.is(Way::In, 0x80) {
                    syncs = look.now;
                }
                if look.is(Way::Out, HEARTBEAT) && syncs.0 > 0 && look.now.0 - syncs.0 < 60_000 {
                    look.pass = None;
                }
            }),
        ),
        fault(
            "does not answer the 60th upload",
            &["ROB-44"],
            Box::new(move |look| {
                if uploads(look, (0x1000, 0)) {
                    requests += 1;
                    if requests == 60 {
                        look.pass = None;
                    }
                }
            }),
        ),
        fault(
            "dies of foreign PDOs",
            &["ROB-46"],
            dies(flood(100, |look| matches!(look.frame.id(), 0x180..=0x57F))),
        ),
        fault(
            "is never served again after a remote frame",
            &["ROB-21"],
            dies(|look| look.frame.id() == REQUEST && look.frame.is_remote()),
        ),
        fault(
            "is deaf in Operational",
            &["ROB-40", "ROB-46"],
            loses(|look| {
                look.is(Way::In, REQUEST) && look.state == State::Operational && look.frame.id() != TPDO
            }),
        ),
    ]
}
