//! Block transfers of a large domain, on good and bad lines.

use canopen::client::sdo;
use canopen::{Duration, Frame};
use nodectl::object::at;
use nodectl::sdo::{Cause, Client};

use crate::loader::Loader;
use crate::wire::{Fate, Wire, client};

const PROGRAM: (u16, u8) = (0x1F50, 1);

fn value(len: usize) -> Vec<u8> {
    (0..len).map(|byte| (byte * 7 % 251) as u8).collect()
}

/// A loader without a program, which accepts a new program at once.
fn empty() -> Wire<Loader> {
    Wire::new(Loader::new(3, &[]))
}

fn write_and_read(client: &mut Client, len: usize) {
    let (object, value) = (at(PROGRAM.0, PROGRAM.1), value(len));
    let mut heard = Vec::new();
    client.block_download(object, &value, |done| heard.push(done)).unwrap();
    assert!(heard.is_sorted() && heard.last() == Some(&len), "{len}: {heard:?}");
}

#[test]
fn lengths_around_segments_and_blocks() {
    for len in [1, 6, 7, 8, 126 * 7, 127 * 7 - 1, 127 * 7, 127 * 7 + 1, 254 * 7, 255 * 7, 10_000] {
        let wire = empty();
        let mut network = wire.network();
        write_and_read(&mut client(&mut network, 3), len);
        assert_eq!(wire.station(|loader| loader.flash().program.clone()), value(len), "{len}");
        // The loader checks the program for a moment. The domain can be read meanwhile.
        let object = at(PROGRAM.0, PROGRAM.1);
        assert_eq!(client(&mut network, 3).block_upload(object).unwrap(), value(len), "{len}");
        assert_eq!(client(&mut network, 3).upload(object).unwrap(), value(len), "{len}");
    }
}

#[test]
fn segmented_takes_the_same_values() {
    for len in [0, 5, 7, 1000] {
        let wire = empty();
        let mut network = wire.network();
        let mut last = 0;
        client(&mut network, 3).download(at(PROGRAM.0, PROGRAM.1), &value(len), |done| last = done).unwrap();
        assert_eq!((last, wire.station(|loader| loader.flash().program.clone())), (len, value(len)));
    }
}

#[test]
fn lost_segments_are_sent_again() {
    for n in [10, 50, 100, 128, 129, 333] {
        let wire = empty();
        let mut network = wire.network();
        network.pause(Duration::from_millis(10)).unwrap();
        // Only segments are lost; requests and answers arrive. In the middle of a transfer nearly all frames are
        // segments.
        let mut count = 0;
        wire.disturb(move |frame| {
            let is_segment = frame.len() == 8 && matches!(frame.data()[0] & 0x7F, 1..=0x7F);
            let is_service = matches!(frame.data().first(), Some(0xA0..=0xC6));
            count += 1;
            if is_segment && !is_service && count % n == 0 { Fate::IsLost } else { Fate::Arrives }
        });
        let object = at(PROGRAM.0, PROGRAM.1);
        client(&mut network, 3).block_download(object, &value(20_000), |_| ()).unwrap();
        assert_eq!(wire.station(|loader| loader.flash().program.clone()), value(20_000), "1 of {n}");
        assert_eq!(client(&mut network, 3).block_upload(object).unwrap(), value(20_000), "1 of {n}");
    }
}

#[test]
fn every_nth_frame_lost_ends_with_the_value_or_with_an_error() {
    let mut arrived = 0;
    for n in 2..60 {
        let wire = empty();
        let mut network = wire.network();
        network.pause(Duration::from_millis(10)).unwrap();
        wire.lose_every(n);
        let object = at(PROGRAM.0, PROGRAM.1);
        // A bad line may make the transfer fail. But a failed transfer must never count as success.
        if client(&mut network, 3).block_download(object, &value(3000), |_| ()).is_ok() {
            assert_eq!(wire.station(|loader| loader.flash().program.clone()), value(3000), "1 of {n}");
            arrived += 1;
        }
        if let Ok(read) = client(&mut network, 3).block_upload(object) {
            assert!(wire.station(|loader| loader.flash().program == read), "1 of {n}");
        }
    }
    assert!(arrived > 20, "only {arrived} arrived");
}

#[test]
fn a_server_without_blocks_refuses_by_protocol() {
    let wire = empty();
    wire.station(|loader| loader.flash().has_blocks = false);
    let mut network = wire.network();
    let error =
        client(&mut network, 3).block_download(at(PROGRAM.0, PROGRAM.1), &value(100), |_| ()).unwrap_err();
    assert!(error.abort().is_some_and(nodectl::sdo::AbortCode::is_protocol), "{error}");
}

#[test]
fn an_upload_that_was_changed_on_the_way_is_a_crc_error() {
    // A CAN bus does not change frames, but a faulty gateway may.
    let wire = empty();
    let mut network = wire.network();
    let object = at(PROGRAM.0, PROGRAM.1);
    client(&mut network, 3).block_download(object, &value(100), |_| ()).unwrap();
    wire.disturb(|frame| match frame.data() {
        [3, a, data @ ..] if frame.id() == 0x583 => {
            let data = [&[3, a ^ 0x10], data].concat();
            Fate::BecomesAnother(Frame::new(0x583, &data).unwrap())
        }
        _ => Fate::Arrives,
    });
    let error = client(&mut network, 3).block_upload(object).unwrap_err();
    assert!(matches!(error.cause, Cause::Transfer(sdo::Error::Crc)), "{error}");
    wire.disturb(|_| Fate::Arrives);
    assert_eq!(client(&mut network, 3).block_upload(object).unwrap(), value(100));
}
