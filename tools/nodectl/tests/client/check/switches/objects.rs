//! Faults of objects: absent, wrong, or with another value than the one written. Also faults of saving and of profiles.

use super::super::faulty::frame;
use super::super::layers::{REQUEST, aborts_otherwise, downloads, keeps, lacks, reads, refuses, swallows};
use super::{Switch, fault};

pub(super) fn switches() -> Vec<Switch> {
    [dictionary(), storage(), profiles()].into_iter().flatten().collect()
}

fn dictionary() -> Vec<Switch> {
    vec![
        fault("has two bytes in 1006h", &["DIC-01"], reads(0x1006, 0, &[0, 0])),
        fault("has two bytes in an own parameter", &["DIC-02"], reads(0x2003, 0, &[0, 0])),
        fault("starts with another 1007h", &["DIC-03"], reads(0x1007, 0, &[5, 0, 0, 0])),
        fault("starts with another own parameter", &["DIC-04"], reads(0x2003, 0, &[5, 0, 0, 0])),
        fault("takes a write to 1001h", &["DIC-05"], swallows(0x1001, 0)),
        fault("shows what can only be written", &["DIC-06", "SDO-04"], reads(0x2002, 0, &[1, 2, 3, 4])),
        fault("takes what is out of limits", &["DIC-07", "DIC-08", "SDO-13"], swallows(0x2001, 0)),
        fault("refuses the own value of a parameter", &["DIC-09"], refuses(0x1007, 0)),
        fault("has another name", &["DIC-10"], reads(0x1008, 0, b"name")),
        fault("has five in 1018h:0", &["DIC-11"], reads(0x1018, 0, &[5])),
        fault("has a 1018h:5", &["DIC-12", "SDO-05"], reads(0x1018, 5, &[0, 0, 0, 0])),
        fault("has a wrong object code in sub-index FFh", &["DIC-14"], reads(0x1018, 0xFF, &[7, 7, 0, 0])),
        fault("has 1 as its profile", &["DIC-15"], reads(0x1000, 0, &[1, 0, 0, 0])),
        fault("has no 1018h", &["DIC-16", "DIC-01"], lacks(&[0x1018])),
        fault("has other COB-IDs in 1200h", &["SDO-80"], reads(0x1200, 1, &[1, 6, 0, 0])),
        fault("keeps the COB-ID of a server through reset communication", &["SDO-82"], keeps(0x1201, 1)),
        fault("takes a write to 1200h", &["SDO-83", "DIC-05"], swallows(0x1200, 1)),
    ]
}

fn storage() -> Vec<Switch> {
    let mut restarts = 0;
    vec![
        fault(
            "tells a wrong signature otherwise",
            &["STO-01", "STO-02", "STO-03", "STO-04", "STO-05", "STO-06"],
            aborts_otherwise(&[0x0800_0020]),
        ),
        fault("has unknown bits in 1010h", &["STO-07"], reads(0x1010, 1, &[0xFF, 0, 0, 0])),
        fault("has unknown bits in 1011h", &["STO-08"], reads(0x1011, 1, &[0xFF, 0, 0, 0])),
        fault(
            "does not save",
            &["STO-20", "STO-24", "STO-25", "STO-26", "STO-27", "STO-28", "STO-29", "STO-30", "STO-43"],
            swallows(0x1010, 1),
        ),
        fault("does not save communication parameters by 1010h:2", &["STO-21"], swallows(0x1010, 2)),
        fault("keeps a heartbeat time that was not saved", &["STO-22", "NMT-10"], keeps(0x1017, 0)),
        fault(
            "saves everything by 1010h:3",
            &["STO-23"],
            Box::new(|look| {
                if let Some(mut data) = downloads(look, (0x1010, 3)) {
                    data[3] = 1;
                    look.replace(&data);
                }
            }),
        ),
        fault("does not restore", &["STO-40"], swallows(0x1011, 1)),
        fault("does not restore communication parameters by 1011h:2", &["STO-42"], swallows(0x1011, 2)),
        fault(
            "has the defaults at once",
            &["STO-41"],
            Box::new(|look| {
                if downloads(look, (0x1011, 1)).is_some_and(|data| &data[4..] == b"load") {
                    look.to_device.push(frame(REQUEST, &[0x2B, 0x17, 0x10, 0, 0xE8, 3, 0, 0]));
                }
            }),
        ),
        fault(
            "forgets what is saved with the second restart",
            &["STO-43"],
            Box::new(move |look| {
                if downloads(look, (0x1010, 1)).is_some() {
                    restarts = 0;
                }
                if super::super::layers::is_command(look, 0x81) {
                    restarts += 1;
                    look.forgets = restarts >= 2;
                }
            }),
        ),
    ]
}

fn profiles() -> Vec<Switch> {
    vec![
        fault("is a measuring device and does not say so", &["P404-01"], reads(0x1000, 0, &[0, 0, 0, 0])),
        fault("is a measuring device without a process value", &["P404-02"], lacks(&[0x6130])),
        fault("is a measuring device without a sensor type", &["P404-03", "P404-07"], lacks(&[0x6110])),
        fault("is a measuring device without a unit", &["P404-04"], lacks(&[0x6131])),
        fault("is a measuring device without decimal digits", &["P404-05"], lacks(&[0x6132])),
        fault("is a measuring device without a status", &["P404-06"], lacks(&[0x6150])),
        fault("has two channels of one object and one of another", &["P404-07"], reads(0x6132, 0, &[2])),
        fault("takes any signature for a tare", &["P404-08"], swallows(0x6139, 1)),
        fault("has an alarm in one object and none in the other", &["P404-09"], reads(0x6600, 1, &[1])),
        fault("is an encoder and does not say so", &["P406-01"], reads(0x1000, 0, &[0, 0, 0, 0])),
        fault("is an encoder without operating parameters", &["P406-02"], lacks(&[0x6000])),
        fault("is an encoder without a position", &["P406-03"], lacks(&[0x6004, 0x6020])),
        fault("is an encoder without an operating status", &["P406-04"], lacks(&[0x6500])),
        fault("is an encoder without a resolution", &["P406-05"], lacks(&[0x6501])),
        fault("is an encoder without a number of revolutions", &["P406-06"], lacks(&[0x6502])),
        fault("has a status that does not follow the parameters", &["P406-07"], reads(0x6500, 0, &[0, 0])),
        fault("takes a write to its position", &["P406-08"], swallows(0x6004, 0)),
        fault("has a speed for a channel without a position", &["P406-09"], reads(0x6030, 0, &[2])),
        fault("has an area state of two bytes", &["P417-06"], reads(0x63B0, 1, &[0, 0])),
        fault("has a limit of two bytes", &["P417-07"], reads(0x63B8, 1, &[0, 0])),
        fault("is a lift device and does not say so", &["P417-01"], reads(0x1000, 0, &[0, 0, 0, 0])),
        fault("is a lift device without 6000h", &["P417-02", "P417-03"], lacks(&[0x6000])),
        fault("is of no lift", &["P417-04"], lacks(&[0x6001])),
        fault(
            "is an I/O module and does not say so",
            &["P401-01", "P401-02"],
            reads(0x1000, 0, &[0, 0, 0, 0]),
        ),
        fault("is an I/O module without its digital inputs", &["P401-03"], lacks(&[0x6000])),
        fault("is an I/O module without its digital outputs", &["P401-04"], lacks(&[0x6200])),
        fault("is an I/O module without its analogue inputs", &["P401-05"], lacks(&[0x6401])),
        fault("is an I/O module without its analogue outputs", &["P401-06"], lacks(&[0x6411])),
    ]
}
