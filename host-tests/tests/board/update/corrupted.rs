//! Invalid images, each downloaded to the bootloader on the board. The table of crate `update` is longer (`cargo test
//! -p update --test corrupted`); this one shows the same for the bus and the flash driver.

use bsp::flash::update_layout::LAYOUT;
use crc::{CRC_32_ISO_HDLC, Crc};
use ed25519_dalek::SigningKey;
use programmer::sign::image::Image;
use update::{Description, HEADER_LEN, SIGNED_LEN};

use super::bench::{Bench, signed, version_a};

/// The name of the fault, the bytes of the image, and the code in 1F57h.
type Kind = (&'static str, Vec<u8>, u8);

const UNKNOWN_FORMAT: u8 = 2;
const CRC: u8 = 3;
const TOO_LONG: u8 = 6;
const BOARD: u8 = 64;
const HARDWARE: u8 = 65;
const SIGNATURE: u8 = 67;
const TRUNCATED: u8 = 68;
const EXCESS: u8 = 69;

/// Length of the code in bytes: more than a block of 127 segments.
const LENGTH: usize = 2000;

fn code() -> Vec<u8> {
    (0..LENGTH).map(|byte| (byte % 251) as u8).collect()
}

fn good() -> Image {
    signed(code(), |_| ())
}

fn about(change: impl FnOnce(&mut Description)) -> Vec<u8> {
    signed(code(), change).to_bytes()
}

fn bytes(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = good().to_bytes();
    change(&mut bytes);
    bytes
}

/// An image with a changed header and a corrected CRC: the best that an attacker without a key can do.
fn header(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    bytes(|bytes| {
        change(bytes);
        let crc = checksum(&bytes[..HEADER_LEN - 4]);
        put(HEADER_LEN - 4, crc)(bytes);
    })
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}

fn put(at: usize, word: u32) -> impl FnOnce(&mut Vec<u8>) {
    move |bytes| bytes[at..at + 4].copy_from_slice(&word.to_le_bytes())
}

fn flip(at: usize) -> impl FnOnce(&mut Vec<u8>) {
    move |bytes| bytes[at] ^= 0x10
}

fn cut_to(length: usize) -> Vec<u8> {
    bytes(|bytes| bytes.truncate(length))
}

fn lengths() -> Vec<Kind> {
    let whole = HEADER_LEN + LENGTH;
    let area = LAYOUT.application().size();
    vec![
        ("a single byte", cut_to(1), TRUNCATED),
        ("half a header", cut_to(256), TRUNCATED),
        ("a header alone", cut_to(HEADER_LEN), TRUNCATED),
        ("half of the code", cut_to(whole / 2), TRUNCATED),
        ("the last byte missing", cut_to(whole - 1), TRUNCATED),
        ("a byte too many", bytes(|bytes| bytes.push(0)), EXCESS),
        ("the image twice", bytes(|bytes| bytes.extend(good().to_bytes())), EXCESS),
        ("longer than the area", bytes(|bytes| bytes.resize(area as usize + 4, 0)), TOO_LONG),
        ("a length beyond the area", header(put(24, area)), TOO_LONG),
        ("a length longer than the code", header(put(24, LENGTH as u32 + 4)), TRUNCATED),
        ("a length shorter than the code", header(put(24, LENGTH as u32 - 4)), EXCESS),
    ]
}

fn headers() -> Vec<Kind> {
    vec![
        ("erased flash", vec![0xFF; LENGTH], UNKNOWN_FORMAT),
        ("zeros", vec![0; LENGTH], UNKNOWN_FORMAT),
        ("code without a header", code(), UNKNOWN_FORMAT),
        ("another magic number", header(flip(0)), UNKNOWN_FORMAT),
        ("the format before", header(put(4, 1)), UNKNOWN_FORMAT),
        ("a bit of the header", bytes(flip(17)), CRC),
        ("a bit of the header's CRC", bytes(flip(HEADER_LEN - 1)), CRC),
        ("reserved bytes in use", header(put(300, 1)), CRC),
        ("no code by the header", header(put(24, 0)), CRC),
        ("another board", about(|about| about.board += 1), BOARD),
        ("other hardware", about(|about| about.hardware = 2), HARDWARE),
    ]
}

fn contents() -> Vec<Kind> {
    let stranger = Image::sign(good().header.description(), code(), &SigningKey::from_bytes(&[7; 32]));
    let other_code = header(|bytes| {
        flip(HEADER_LEN + 8)(bytes);
        let crc = checksum(&bytes[HEADER_LEN..]);
        put(28, crc)(bytes);
    });
    let transplanted = header(|bytes| {
        bytes[SIGNED_LEN..HEADER_LEN - 4].copy_from_slice(version_a().header.signature());
    });
    vec![
        ("the first bit of the code", bytes(flip(HEADER_LEN)), CRC),
        ("the last byte of the code", bytes(flip(HEADER_LEN + LENGTH - 1)), CRC),
        ("two parts of the code exchanged", bytes(|bytes| bytes[HEADER_LEN..].rotate_left(1000)), CRC),
        ("other code with its CRC", other_code, SIGNATURE),
        ("a higher counter by hand", header(put(32, 9)), SIGNATURE),
        ("not signed", header(|bytes| bytes[SIGNED_LEN..HEADER_LEN - 4].fill(0)), SIGNATURE),
        ("a bit of the signature", header(flip(SIGNED_LEN + 40)), SIGNATURE),
        ("the signature of another image", transplanted, SIGNATURE),
        ("the key of a stranger", stranger.unwrap().to_bytes(), SIGNATURE),
    ]
}

#[test]
fn a_bad_image_is_refused_with_its_code_and_the_old_application_starts() {
    let mut bench = Bench::running();
    let before = bench.application();
    bench.stop();
    let kinds = [lengths(), headers(), contents()].concat();
    for (what, image, code) in &kinds {
        bench.clear();
        assert!(bench.download(image).is_err() || bench.wait_for_flash().code != 0, "{what}");
        let status = bench.settled();
        println!("{what}: {status}");
        assert_eq!(status.code, *code, "{what}");
        assert!(bench.application() == before, "{what}: the application was touched");
    }
    println!("{} kinds of images refused", kinds.len());
    assert!(kinds.len() >= 20);
    assert_eq!(bench.start(), version_a().header.code_crc());
}

/// Only the security counter of a confirmed image is in force, so the test takes two updates.
#[test]
fn an_image_with_a_lower_counter_is_refused() {
    const COUNTER: u8 = 66;
    let code = version_a().code;
    let newer = signed(code.clone(), |about| about.counter = 3);
    let older = signed(code[..LENGTH].to_vec(), |about| about.counter = 2);
    let mut bench = Bench::running();
    bench.update(&newer);
    bench.confirm();
    bench.stop();
    bench.clear();
    let _ = bench.download(&older.to_bytes());
    let status = bench.settled();
    assert_eq!((status.code, status.detail), (COUNTER, 3), "{status}");
    assert_eq!(bench.start(), newer.header.code_crc());
}
