//! Faults of PDOs.

use canopen::nmt::State;

use super::super::faulty::{Look, Way, frame};
use super::super::layers::{
    EMCY, RPDO, TPDO, aborts_otherwise, babbles, command, downloads, hears, is_late, keeps, loses, reads,
    refuses, replies, sends_otherwise, swallows,
};
use super::{Switch, fault};

pub(super) fn switches() -> Vec<Switch> {
    [objects(), transmission(), silence(), mapping(), receipt()].into_iter().flatten().collect()
}

fn objects() -> Vec<Switch> {
    vec![
        fault("has two bytes in 1400h:2", &["PDO-01"], reads(0x1400, 2, &[0, 0])),
        fault("has two bytes in 1800h:2", &["PDO-02"], reads(0x1800, 2, &[0, 0])),
        fault("has another CAN-ID in 1400h", &["PDO-03"], reads(0x1400, 1, &[0xD6, 6, 0, 0])),
        fault("has another CAN-ID in 1800h", &["PDO-04"], reads(0x1800, 1, &[0xD6, 6, 0, 0])),
        fault(
            "takes any COB-ID of a TPDO and does not follow",
            &["PDO-05", "PDO-07", "PDO-13"],
            swallows(0x1800, 1),
        ),
        fault("takes any COB-ID of an RPDO and does not follow", &["PDO-06", "PDO-08"], swallows(0x1400, 1)),
        fault("takes an inhibit time at any time", &["PDO-09"], swallows(0x1800, 3)),
        fault("takes any type of a TPDO", &["PDO-10", "PDO-25"], swallows(0x1800, 2)),
        fault("takes any type of an RPDO", &["PDO-11", "PDO-95"], swallows(0x1400, 2)),
        fault("has a sub-index 4", &["PDO-12"], reads(0x1800, 4, &[0, 0])),
        fault(
            "sends a TPDO with its former CAN-ID",
            &["PDO-14"],
            Box::new(|look| {
                if look.is(Way::Out, 0x6D3) {
                    look.pass = Some(frame(TPDO, look.frame.data()));
                }
            }),
        ),
        fault("keeps its transmission type through a reset", &["PDO-15"], keeps(0x1800, 2)),
        fault("takes a SYNC start value at any time", &["PDO-16"], swallows(0x1800, 6)),
    ]
}

const OP: &[State] = &[State::Operational];

fn is_sync(look: &Look) -> bool {
    look.is(Way::In, 0x80)
}

fn transmission() -> Vec<Switch> {
    vec![
        fault(
            "does not answer a remote frame",
            &["PDO-20"],
            loses(|look| look.way == Way::In && look.frame.id() == TPDO && look.frame.is_remote()),
        ),
        fault(
            "takes a SYNC for two",
            &["PDO-23", "PDO-24"],
            Box::new(|look| {
                if is_sync(look) {
                    look.to_device.push(look.frame);
                }
            }),
        ),
        fault("refuses a new transmission type", &["PDO-25", "PDO-15"], refuses_type_240()),
        fault(
            "sends a TPDO as it likes",
            &["PDO-26", "PDO-28", "PDO-30"],
            babbles(30, OP, frame(TPDO, &[0, 0])),
        ),
        fault(
            "sends two frames with a SYNC",
            &["PDO-27", "PDO-31"],
            Box::new(|look| {
                if is_sync(look) {
                    look.to_bus.extend([frame(TPDO, &[0, 0]); 2]);
                }
            }),
        ),
        fault(
            "does not look at the counter of a SYNC",
            &["PDO-29"],
            hears(|look| (is_sync(look) && look.frame.len() == 1).then(|| frame(0x80, &[4]))),
        ),
        fault("is slow after a SYNC", &["PDO-32"], is_late(TPDO, 15)),
    ]
}

/// Refuses type 240, and keeps the written type through a reset.
fn refuses_type_240() -> super::Layer {
    let mut kept = keeps(0x1800, 2);
    Box::new(move |look| {
        if downloads(look, (0x1800, 2)).is_some_and(|data| data[4] == 240) {
            return look.answer([0x80, 0x00, 0x18, 2, 0x30, 0, 9, 6]);
        }
        kept(look);
    })
}

fn silence() -> Vec<Switch> {
    let value = || frame(TPDO, &[0, 0]);
    vec![
        fault(
            "sends PDOs in Stopped",
            &["PDO-41", "PDO-42", "PDO-43", "PDO-44", "PDO-45"],
            babbles(30, &[State::Stopped], value()),
        ),
        fault(
            "sends PDOs in Pre-operational",
            &["PDO-47", "PDO-48", "PDO-49", "PDO-50", "PDO-51"],
            babbles(30, &[State::PreOperational], value()),
        ),
        fault(
            "answers a remote frame in every state",
            &["PDO-40", "PDO-46"],
            replies(move |look| (look.frame.is_remote() && look.frame.id() == TPDO).then(value)),
        ),
    ]
}

fn mapping() -> Vec<Switch> {
    vec![
        fault("has an RPDO of an absent object", &["PDO-60"], reads(0x1600, 1, &[0x10, 0, 0xFF, 0x0F])),
        fault("has a TPDO of an absent object", &["PDO-61"], reads(0x1A00, 1, &[0x10, 0, 0xFF, 0x0F])),
        fault("maps nothing into a TPDO", &["PDO-62", "PDO-71"], refuses(0x1A00, 1)),
        fault("maps nothing into an RPDO", &["PDO-63", "PDO-68"], refuses(0x1600, 1)),
        fault("takes a mapping entry at any time", &["PDO-64"], swallows(0x1A00, 1)),
        fault(
            "takes a number of mapped objects at any time",
            &["PDO-65", "PDO-66", "PDO-67"],
            swallows(0x1A00, 0),
        ),
        fault(
            "tells what cannot be mapped otherwise",
            &["PDO-69", "PDO-70", "PDO-72", "PDO-73"],
            aborts_otherwise(&[0x0604_0041]),
        ),
        fault(
            "has no RPDO with objects",
            &["PDO-74"],
            Box::new(|look| {
                if downloads(look, (0x1600, 0)).is_some_and(|data| data[4] == 1) {
                    look.answer([0x80, 0x00, 0x16, 0, 0, 0, 0, 8]);
                }
            }),
        ),
        fault(
            "tells nothing of what a PDO cannot carry",
            &["PDO-75", "PDO-76", "PDO-67"],
            aborts_otherwise(&[
                0x0602_0000,
                0x0604_0041,
                0x0604_0042,
                0x0607_0010,
                0x0607_0012,
                0x0607_0013,
                0x0609_0030,
            ]),
        ),
        fault(
            "sends a byte too many",
            &["PDO-77", "PDO-80", "PDO-82"],
            sends_otherwise(TPDO, |data, _| [data, &[0]].concat().into_iter().take(8).collect()),
        ),
        fault("keeps its mapping through a reset", &["PDO-78"], keeps(0x1A00, 0)),
        fault(
            "sends other values than it has",
            &["PDO-80", "PDO-82"],
            sends_otherwise(TPDO, |data, _| data.iter().map(|byte| !byte).collect()),
        ),
    ]
}

fn is_rpdo(look: &Look) -> bool {
    look.is(Way::In, RPDO)
}

fn receipt() -> Vec<Switch> {
    vec![
        fault("takes no RPDO", &["PDO-81", "PDO-94", "PDO-95"], loses(is_rpdo)),
        fault(
            "takes an RPDO in every state",
            &["PDO-90", "PDO-91"],
            Box::new(|look| {
                let back = match look.state {
                    State::Stopped => 2,
                    State::PreOperational => 0x80,
                    _ => return,
                };
                if is_rpdo(look) {
                    look.pass = None;
                    look.to_device.extend([command(1), look.frame, command(back)]);
                }
            }),
        ),
        fault(
            "fills up an RPDO that is too short",
            &["PDO-92", "PDO-93"],
            hears(|look| {
                // The missing byte is filled up with 0, as if the RPDO were complete.
                let data = look.frame.data();
                (is_rpdo(look) && data.len() < 2)
                    .then(|| frame(RPDO, &[data.first().copied().unwrap_or(0), 0]))
            }),
        ),
        fault(
            "does not tell a short RPDO",
            &["PDO-93"],
            loses(|look| look.is(Way::Out, EMCY) && look.frame.data().starts_with(&[0x10, 0x82])),
        ),
        fault(
            "takes no RPDO that is too long",
            &["PDO-94"],
            loses(|look| is_rpdo(look) && look.frame.len() > 2),
        ),
        fault(
            "takes a synchronous RPDO at once",
            &["PDO-95"],
            Box::new(|look| {
                if is_rpdo(look) {
                    look.to_device.push(frame(0x80, &[]));
                }
            }),
        ),
        fault(
            "switches no RPDO off in Operational",
            &["PDO-96"],
            Box::new(|look| {
                let off = downloads(look, (0x1400, 1)).filter(|data| data[7] & 0x80 != 0);
                if off.is_some() && look.state == State::Operational {
                    look.answer([0x60, 0x00, 0x14, 1, 0, 0, 0, 0]);
                }
            }),
        ),
        fault(
            "takes an RPDO with its former CAN-ID",
            &["PDO-97"],
            hears(|look| is_rpdo(look).then(|| frame(0x6D5, look.frame.data()))),
        ),
        fault(
            "does not tell an RPDO that is late",
            &["PDO-98"],
            loses(|look| look.is(Way::Out, EMCY) && look.frame.data().starts_with(&[0x50, 0x82])),
        ),
    ]
}
