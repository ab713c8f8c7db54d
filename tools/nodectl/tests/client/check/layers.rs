//! Layers with a fault each, from which the switches choose.

use super::device::ID;
use super::faulty::{Layer, Look, Way, frame};
use canopen::Frame;
use canopen::nmt::State;

/// The CAN-IDs of the device.
pub(super) const OWN: u16 = ID as u16;
pub(super) const EMCY: u16 = 0x80 + OWN;
pub(super) const TPDO: u16 = 0x180 + OWN;
pub(super) const RPDO: u16 = 0x200 + OWN;
pub(super) const RESPONSE: u16 = 0x580 + OWN;
pub(super) const REQUEST: u16 = 0x600 + OWN;
pub(super) const HEARTBEAT: u16 = 0x700 + OWN;

/// Index and sub-index of a request or a response.
pub(super) fn place(data: [u8; 8]) -> (u16, u8) {
    (u16::from_le_bytes([data[1], data[2]]), data[3])
}

fn head(command: u8, (index, sub): (u16, u8)) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, 0, 0, 0, 0]
}

fn abort(at: (u16, u8), code: u32) -> [u8; 8] {
    let mut data = head(0x80, at);
    data[4..].copy_from_slice(&code.to_le_bytes());
    data
}

/// Whether a request begins an upload or a download of any kind: expedited, segmented or in blocks.
fn begins(data: [u8; 8]) -> bool {
    matches!(data[0] >> 5, 1 | 2)
        || data[0] >> 5 == 5 && data[0] & 3 == 0
        || data[0] >> 5 == 6 && data[0] & 1 == 0
}

/// The request that begins a download to an object.
pub(super) fn downloads(look: &Look, at: (u16, u8)) -> Option<[u8; 8]> {
    look.request().filter(|data| data[0] >> 5 == 1 && place(*data) == at)
}

/// Whether a request begins an upload of an object.
pub(super) fn uploads(look: &Look, at: (u16, u8)) -> bool {
    look.request().is_some_and(|data| data[0] >> 5 == 2 && place(data) == at)
}

/// Replaces any of these abort codes by another.
pub(super) fn aborts_otherwise(codes: &'static [u32]) -> Layer {
    Box::new(move |look| {
        let Some(data) = look.response().filter(|data| data[0] == 0x80) else { return };
        if codes.contains(&u32::from_le_bytes([data[4], data[5], data[6], data[7]])) {
            look.replace(&abort(place(data), 0x0504_0005));
        }
    })
}

/// Makes an object read as these bytes.
pub(super) fn reads(index: u16, sub: u8, bytes: &'static [u8]) -> Layer {
    Box::new(move |look| {
        if uploads(look, (index, sub)) {
            let unused = 4 - u8::try_from(bytes.len()).expect("at most four bytes");
            let mut data = head(0x43 | unused << 2, (index, sub));
            data[4..4 + bytes.len()].copy_from_slice(bytes);
            look.answer(data);
        }
    })
}

/// Refuses downloads to an object.
pub(super) fn refuses(index: u16, sub: u8) -> Layer {
    Box::new(move |look| {
        if downloads(look, (index, sub)).is_some() {
            look.answer(abort((index, sub), 0x0800_0000));
        }
    })
}

/// Acknowledges downloads to an object without executing them.
pub(super) fn swallows(index: u16, sub: u8) -> Layer {
    Box::new(move |look| {
        if downloads(look, (index, sub)).is_some_and(|data| data[0] & 2 != 0) {
            look.answer(head(0x60, (index, sub)));
        }
    })
}

/// Answers all reads of an object with the value that was written last, even after a restart.
pub(super) fn keeps(index: u16, sub: u8) -> Layer {
    let mut kept: Option<[u8; 8]> = None;
    Box::new(move |look| {
        if let Some(data) = downloads(look, (index, sub)) {
            kept = Some(data);
        }
        if let Some(mut data) = kept.filter(|_| uploads(look, (index, sub))) {
            data[0] = 0x40 | data[0] & 0x0F;
            look.answer(data);
        }
    })
}

/// Makes these objects absent.
pub(super) fn lacks(indices: &'static [u16]) -> Layer {
    Box::new(move |look| {
        let Some(data) = look.request().filter(|data| begins(*data)) else { return };
        if indices.contains(&place(data).0) {
            look.answer(abort(place(data), 0x0602_0000));
        }
    })
}

/// Changes responses of the SDO server.
pub(super) fn responds(change: impl Fn(&mut [u8; 8]) + 'static) -> Layer {
    Box::new(move |look| {
        if let Some(mut data) = look.response() {
            change(&mut data);
            look.replace(&data);
        }
    })
}

/// Loses the frames that fulfil a condition, in both directions.
pub(super) fn loses(is_lost: impl Fn(&Look) -> bool + 'static) -> Layer {
    Box::new(move |look| {
        if look.way != Way::Tick && is_lost(look) {
            look.pass = None;
        }
    })
}

/// Sends a frame every `ms` milliseconds, in some states.
pub(super) fn babbles(ms: u64, states: &'static [State], say: Frame) -> Layer {
    Box::new(move |look| {
        if look.way == Way::Tick && look.now.0 / 10_000 % (ms / 10) == 0 && states.contains(&look.state) {
            look.to_bus.push(say);
        }
    })
}

/// Changes the data of the device's frames with this CAN-ID.
pub(super) fn sends_otherwise(id: u16, change: impl Fn(&[u8], State) -> Vec<u8> + 'static) -> Layer {
    Box::new(move |look| {
        if look.is(Way::Out, id) {
            let data = change(look.frame.data(), look.state);
            look.replace(&data);
        }
    })
}

/// Delays the device's frames with this CAN-ID by `ms` milliseconds.
pub(super) fn is_late(id: u16, ms: u64) -> Layer {
    Box::new(move |look| {
        if look.is(Way::Out, id) {
            look.later.push((ms, look.frame));
            look.pass = None;
        }
    })
}

/// Changes frames to the device.
pub(super) fn hears(change: impl Fn(&Look) -> Option<Frame> + 'static) -> Layer {
    Box::new(move |look| {
        if let Some(frame) = change(look).filter(|_| look.way == Way::In) {
            look.pass = Some(frame);
        }
    })
}

/// Answers some frames to the device with an additional frame.
pub(super) fn replies(reply: impl Fn(&Look) -> Option<Frame> + 'static) -> Layer {
    Box::new(move |look| {
        if let Some(frame) = reply(look).filter(|_| look.way == Way::In) {
            look.to_bus.push(frame);
        }
    })
}

/// Stops the SDO server for ten seconds after a frame that fulfils a condition.
pub(super) fn dies(mut kills: impl FnMut(&Look) -> bool + 'static) -> Layer {
    let mut until = canopen::Instant(0);
    Box::new(move |look| {
        if look.way == Way::In && kills(look) {
            until = look.now + canopen::Duration::from_millis(10_000);
        }
        if look.now < until && look.is(Way::In, REQUEST) {
            look.pass = None;
        }
    })
}

/// An NMT command to the device.
pub(super) fn command(specifier: u8) -> Frame {
    frame(0, &[specifier, ID])
}

/// Whether a frame is this NMT command to the device.
pub(super) fn is_command(look: &Look, specifier: u8) -> bool {
    look.is(Way::In, 0) && look.frame.data() == [specifier, ID]
}
