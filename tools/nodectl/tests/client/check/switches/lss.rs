//! Faults of the LSS slave.

use super::super::faulty::{Layer, Way, frame};
use super::super::layers::{REQUEST, hears, loses, replies, sends_otherwise};
use super::{Switch, fault};

const ASKED: u16 = 0x7E5;
const TOLD: u16 = 0x7E4;

/// The identity of the device.
const IDENTITY: [u32; 4] = [0x1A2, 0x77, 0x0001_0003, 0];

/// Changes one byte of the responses with this command.
fn tells_otherwise(command: u8, byte: usize, value: u8) -> Layer {
    sends_otherwise(TOLD, move |data, _| {
        let mut data = data.to_vec();
        if data[0] == command {
            data[byte] = value;
        }
        data
    })
}

/// Always gives this answer to requests with this command.
fn always_fails_a_check(command: u8, answer: u8) -> Layer {
    replies(move |look| {
        let is_it = look.frame.id() == ASKED && look.frame.data().first() == Some(&command);
        is_it.then(|| frame(TOLD, &[answer, 0, 0, 0, 0, 0, 0, 0]))
    })
}

pub(super) fn switches() -> Vec<Switch> {
    let mut is_selected = false;
    vec![
        fault(
            "answers LSS with seven bytes",
            &["LSS-01"],
            sends_otherwise(TOLD, |data, _| if data[0] == 0x44 { data[..7].to_vec() } else { data.to_vec() }),
        ),
        fault(
            "does not compare its identity",
            &["LSS-02", "LSS-03", "LSS-04", "LSS-05"],
            hears(|look| {
                let data = look.frame.data();
                let part = data
                    .first()
                    .filter(|command| look.frame.id() == ASKED && (0x40..=0x43).contains(*command))?;
                let [a, b, c, d] = IDENTITY[usize::from(part - 0x40)].to_le_bytes();
                Some(frame(ASKED, &[*part, a, b, c, d, 0, 0, 0]))
            }),
        ),
        fault("tells another vendor-ID by LSS", &["LSS-06"], tells_otherwise(0x5A, 1, 0x55)),
        fault("tells another product code by LSS", &["LSS-07"], tells_otherwise(0x5B, 1, 0x55)),
        fault("tells another revision by LSS", &["LSS-08"], tells_otherwise(0x5C, 1, 0x55)),
        fault("tells another serial number by LSS", &["LSS-09"], tells_otherwise(0x5D, 1, 0x55)),
        fault("tells another node-ID by LSS", &["LSS-10"], tells_otherwise(0x5E, 1, 0x55)),
        fault("tells its node-ID to everybody", &["LSS-11"], always_fails_a_check(0x5E, 0x5E)),
        fault(
            "is not identified",
            &["LSS-12"],
            loses(|look| look.is(Way::Out, TOLD) && look.frame.data().first() == Some(&0x4F)),
        ),
        fault("is identified out of its range", &["LSS-13"], always_fails_a_check(0x4B, 0x4F)),
        fault("says that it has no node-ID", &["LSS-14"], always_fails_a_check(0x4C, 0x50)),
        fault("leaves rubbish in the bytes of LSS", &["LSS-15"], tells_otherwise(0x5E, 7, 0x55)),
        fault("takes any node-ID", &["LSS-20", "LSS-21", "LSS-23"], tells_otherwise(0x11, 1, 0)),
        fault("refuses its own node-ID", &["LSS-22"], tells_otherwise(0x11, 1, 1)),
        fault("takes any bit rate", &["LSS-24", "LSS-25", "LSS-26"], tells_otherwise(0x13, 1, 0)),
        fault("answers an unknown service of LSS", &["LSS-27"], always_fails_a_check(0x3A, 0x3A)),
        fault(
            "answers a short request of LSS",
            &["LSS-28"],
            replies(|look| {
                (look.frame.id() == ASKED && look.frame.len() == 7)
                    .then(|| frame(TOLD, &[0x5E, 5, 0, 0, 0, 0, 0, 0]))
            }),
        ),
        fault(
            "is deaf to SDO while LSS has selected it",
            &["LSS-29"],
            Box::new(move |look| {
                is_selected |= look.is(Way::Out, TOLD) && look.frame.data().first() == Some(&0x44);
                is_selected &= !(look.is(Way::In, ASKED) && look.frame.data().starts_with(&[4, 0]));
                if is_selected && look.is(Way::In, REQUEST) {
                    look.pass = None;
                }
            }),
        ),
    ]
}
