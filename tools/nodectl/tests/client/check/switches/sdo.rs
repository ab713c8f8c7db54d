//! Faults of the SDO server.

use super::super::faulty::{Way, frame};
use super::super::layers::{
    REQUEST, RESPONSE, aborts_otherwise, downloads, hears, is_late, loses, place, reads, refuses, replies,
    responds, swallows, uploads,
};
use super::{Switch, fault};

pub(super) fn switches() -> Vec<Switch> {
    [codes(), expedited(), segmented(), blocks()].into_iter().flatten().collect()
}

fn codes() -> Vec<Switch> {
    vec![
        fault(
            "tells a read-only entry otherwise",
            &["SDO-03", "SDO-47", "SDO-77", "DIC-05", "EMC-46"],
            aborts_otherwise(&[0x0601_0002]),
        ),
        fault("tells a write-only entry otherwise", &["SDO-04", "DIC-06"], aborts_otherwise(&[0x0601_0001])),
        fault(
            "tells an absent sub-index otherwise",
            &["SDO-05", "SDO-06", "DIC-12"],
            aborts_otherwise(&[0x0609_0011]),
        ),
        fault(
            "tells an absent object otherwise",
            &["SDO-07", "SDO-08", "SDO-78", "SDO-81"],
            aborts_otherwise(&[0x0602_0000]),
        ),
        fault(
            "tells an unknown command otherwise",
            &["SDO-09", "SDO-40", "SDO-41"],
            aborts_otherwise(&[0x0504_0001]),
        ),
        fault(
            "tells too many bytes otherwise",
            &["SDO-10", "SDO-42"],
            aborts_otherwise(&[0x0607_0012, 0x0607_0010]),
        ),
        fault(
            "tells too few bytes otherwise",
            &["SDO-11", "SDO-43"],
            aborts_otherwise(&[0x0607_0013, 0x0607_0010]),
        ),
        fault(
            "tells a value that is too high otherwise",
            &["SDO-12", "DIC-07"],
            aborts_otherwise(&[0x0609_0031, 0x0609_0030]),
        ),
        fault(
            "tells a value that is too low otherwise",
            &["SDO-13", "DIC-08"],
            aborts_otherwise(&[0x0609_0032, 0x0609_0030]),
        ),
        fault("tells a wrong toggle bit otherwise", &["SDO-38", "SDO-39"], aborts_otherwise(&[0x0503_0000])),
        fault("tells a wrong CRC otherwise", &["SDO-67"], aborts_otherwise(&[0x0504_0004])),
        fault("tells a wrong block size otherwise", &["SDO-68", "SDO-69"], aborts_otherwise(&[0x0504_0002])),
        fault(
            "tells a wrong sequence number otherwise",
            &["SDO-70"],
            aborts_otherwise(&[0x0504_0002, 0x0504_0003, 0x0504_0001]),
        ),
    ]
}

fn expedited() -> Vec<Switch> {
    let (mut spoiled, mut confused) = (false, 0_usize);
    vec![
        fault("has two bytes in 1000h", &["SDO-01"], reads(0x1000, 0, &[0, 0])),
        fault("refuses a heartbeat time", &["SDO-02", "SDO-24"], refuses(0x1017, 0)),
        fault("takes a write to 1000h", &["SDO-03"], swallows(0x1000, 0)),
        fault(
            "names another object when it is read",
            &["SDO-14"],
            responds(|data| {
                if data[0] >> 5 == 2 && place(*data) == (0x1018, 1) {
                    data[3] = 2;
                }
            }),
        ),
        fault(
            "names no object when it is written",
            &["SDO-15"],
            responds(|data| {
                if data[0] == 0x60 && place(*data) == (0x1017, 0) {
                    data[1..4].fill(0);
                }
            }),
        ),
        fault(
            "names no object in an abort",
            &["SDO-16"],
            responds(|data| {
                if data[0] == 0x80 && place(*data) == (0x1018, 1) {
                    data[1..4].fill(0);
                }
            }),
        ),
        fault(
            "answers an abort",
            &["SDO-17"],
            replies(|look| look.request().filter(|data| data[0] == 0x80).map(|data| frame(RESPONSE, &data))),
        ),
        fault(
            "does not tell the size of an upload",
            &["SDO-18"],
            responds(|data| {
                if data[0] == 0x43 {
                    data[0] = 0x42;
                }
            }),
        ),
        fault(
            "leaves rubbish in reserved bytes",
            &["SDO-19"],
            responds(|data| {
                if data[0] == 0x60 {
                    data[7] = 0xAA;
                }
            }),
        ),
        fault(
            "refuses a download whose size is not told",
            &["SDO-20"],
            Box::new(|look| {
                if let Some(mut data) = look.request().filter(|data| data[0] == 0x22) {
                    data[0] = 0x80;
                    look.answer(data);
                }
            }),
        ),
        fault(
            "answers twice",
            &["SDO-21"],
            Box::new(|look| {
                if look.response().is_some() {
                    look.to_bus.push(look.frame);
                }
            }),
        ),
        fault("answers late", &["SDO-22"], is_late(RESPONSE, 150)),
        fault(
            "refuses a write and does it all the same",
            &["SDO-23"],
            Box::new(move |look| {
                spoiled |= downloads(look, (0x1000, 0)).is_some();
                if spoiled && uploads(look, (0x1000, 0)) {
                    look.answer([0x43, 0x00, 0x10, 0, 1, 2, 3, 4]);
                }
            }),
        ),
        fault(
            "does not take every third value",
            &["SDO-24"],
            Box::new(move |look| {
                if downloads(look, (0x1017, 0)).is_some() {
                    confused += 1;
                    if confused % 3 == 2 {
                        look.answer([0x60, 0x17, 0x10, 0, 0, 0, 0, 0]);
                    }
                }
            }),
        ),
    ]
}

/// Whether a request begins a segmented download to this object.
fn in_segments(data: [u8; 8], index: u16) -> bool {
    data[0] >> 5 == 1 && data[0] & 2 == 0 && place(data).0 == index
}

fn segmented() -> Vec<Switch> {
    let refuses_segments = |index: u16, announced: bool| -> super::Layer {
        Box::new(move |look| {
            let meant =
                look.request().filter(|data| in_segments(*data, index) && (announced || data[0] & 1 == 0));
            if let Some(mut data) = meant {
                data[0] = 0x80;
                look.answer(data);
            }
        })
    };
    let (mut counter, mut uploading) = (0_u8, false);
    vec![
        fault("takes no 1017h in segments", &["SDO-30", "SDO-43"], refuses_segments(0x1017, true)),
        fault("takes no 100Ch in segments", &["SDO-31"], refuses_segments(0x100C, true)),
        fault("wants the size of a download", &["SDO-32"], refuses_segments(0x1017, false)),
        fault(
            "gives up in the middle of an upload",
            &["SDO-33"],
            Box::new(|look| {
                if look.request().is_some_and(|data| data[0] == 0x70) {
                    look.answer([0x80, 0, 0, 0, 0, 0, 4, 5]);
                }
            }),
        ),
        fault(
            "gives other data each time",
            &["SDO-34", "SDO-75"],
            Box::new(move |look| {
                if let Some(mut data) =
                    look.response().filter(|data| data[0] >> 5 == 0 && data[0] & 0x10 == 0 && data[0] < 0x20)
                {
                    counter = counter.wrapping_add(1);
                    data[1] = counter;
                    look.replace(&data);
                }
            }),
        ),
        fault(
            "announces a byte too many",
            &["SDO-35"],
            responds(|data| {
                if data[0] == 0x41 {
                    data[4] += 1;
                }
            }),
        ),
        fault(
            "does not toggle",
            &["SDO-36"],
            responds(|data| {
                if data[0] & 0xF0 == 0x10 {
                    data[0] &= !0x10;
                }
            }),
        ),
        fault(
            "sends segments that are not full",
            &["SDO-37"],
            responds(|data| {
                if data[0] & 0xEF == 0 {
                    data[0] |= 2;
                }
            }),
        ),
        fault(
            "does not hear the client's abort",
            &["SDO-44", "SDO-76"],
            loses(|look| look.request().is_some_and(|data| data[0] == 0x80)),
        ),
        fault(
            "writes what was given up",
            &["SDO-45"],
            hears(|look| {
                look.request()
                    .filter(|data| data[0] == 0x80 && place(*data) == (0x1017, 0))
                    .map(|_| frame(REQUEST, &[0x2B, 0x17, 0x10, 0, 0x11, 0x11, 0, 0]))
            }),
        ),
        fault(
            "begins nothing new in the middle",
            &["SDO-46"],
            Box::new(move |look| {
                let Some(data) = look.request() else { return };
                if uploading && data[0] == 0x40 {
                    look.answer([0x80, data[1], data[2], data[3], 0, 0, 4, 5]);
                }
                uploading = data[0] == 0x40 && place(data) == (0x1008, 0);
            }),
        ),
    ]
}

fn blocks() -> Vec<Switch> {
    vec![
        fault(
            "has no block upload of a short entry",
            &["SDO-60"],
            Box::new(|look| {
                if let Some(mut data) =
                    look.request().filter(|data| data[0] & 0xE3 == 0xA0 && place(*data).0 == 0x1000)
                {
                    data[0] = 0x80;
                    look.answer(data);
                }
            }),
        ),
        fault(
            "spoils the first segment of a block",
            &["SDO-61", "SDO-75", "SDO-62"],
            Box::new(|look| {
                if look.way == Way::Out
                    && look.frame.id() == RESPONSE
                    && look.frame.data().starts_with(&[0x01, b'a'])
                {
                    let mut data = [0; 8];
                    data.copy_from_slice(look.frame.data());
                    data[1] = b'b';
                    look.replace(&data);
                }
            }),
        ),
        fault(
            "sends a wrong CRC",
            &["SDO-62"],
            responds(|data| {
                if data[0] & 0xE3 == 0xC1 {
                    data[1] ^= 0xFF;
                }
            }),
        ),
        fault(
            "never ends a block download",
            &["SDO-63", "SDO-64", "SDO-65", "SDO-66"],
            responds(|data| {
                if data[0] == 0xA1 {
                    data[0] = 0x80;
                }
            }),
        ),
        fault(
            "does not look at the CRC",
            &["SDO-67"],
            responds(|data| {
                if data[0] == 0x80 && data[4..] == [4, 0, 4, 5] {
                    *data = [0xA1, 0, 0, 0, 0, 0, 0, 0];
                }
            }),
        ),
        fault(
            "sends the whole block where one segment was asked for",
            &["SDO-71"],
            hears(|look| {
                let mut data = look.request().filter(|data| data[0] & 0xE3 == 0xA0 && data[4] == 1)?;
                data[4] = 127;
                Some(frame(REQUEST, &data))
            }),
        ),
        fault(
            "does not miss a segment",
            &["SDO-72"],
            responds(|data| {
                if data[..2] == [0xA2, 0] {
                    data[1] = 2;
                }
            }),
        ),
        fault(
            "does not send a segment again",
            &["SDO-73"],
            hears(|look| {
                let mut data = look.request().filter(|data| data[..2] == [0xA2, 4])?;
                data[1] = 5;
                Some(frame(REQUEST, &data))
            }),
        ),
        fault(
            "wants blocks of 128 segments",
            &["SDO-74"],
            responds(|data| {
                if data[0] & 0xFB == 0xA0 {
                    data[4] = 128;
                }
            }),
        ),
    ]
}
