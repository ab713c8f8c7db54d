//! Images that must not run: each is refused with its code, and the application in place starts as before.

use crate::bench::{
    BOARD, HEADER, Image, REVISION, assert_starts, description, download, flash_with, image_a, image_b,
    key_number, keys, noise, run, target, update,
};
use update::{Area, CONTEXT, Description, Refusal, SIGNED_LEN, Status, Updater};

/// A kind of bad image: its description, its bytes, and the code in 1F57h.
type Kind = (&'static str, Vec<u8>, Refusal);

const S: usize = SIGNED_LEN + 32;

/// B with changed bytes and nothing corrected.
fn bytes(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = image_b().bytes();
    change(&mut bytes);
    bytes
}

/// B with a changed header and a corrected CRC: a forgery without the key.
fn header(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    bytes(|bytes| {
        change(bytes);
        let crc = crc_of(&bytes[..HEADER - 4]);
        bytes[HEADER - 4..HEADER].copy_from_slice(&crc.to_le_bytes());
    })
}

fn crc_of(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}

/// B for another device or of another time, with a valid signature.
fn signed(change: impl FnOnce(&mut Description)) -> Vec<u8> {
    let mut about = description(2, 5);
    change(&mut about);
    Image::new(about, 620).bytes()
}

fn put(at: usize, word: u32) -> impl FnOnce(&mut Vec<u8>) {
    move |bytes| bytes[at..at + 4].copy_from_slice(&word.to_le_bytes())
}

fn flip(at: usize) -> impl FnOnce(&mut Vec<u8>) {
    move |bytes| bytes[at] ^= 0x10
}

fn cut_to(len: usize) -> Vec<u8> {
    bytes(|bytes| bytes.truncate(len))
}

fn lengths() -> Vec<Kind> {
    let area = usize::try_from(target().layout.application().size()).unwrap();
    let long = |extra: usize| Image::new(description(2, 5), area - HEADER + extra).bytes();
    let whole = image_b().bytes().len();
    vec![
        ("nothing at all", Vec::new(), Refusal::Truncated),
        ("one byte", cut_to(1), Refusal::Truncated),
        ("half a header", cut_to(300), Refusal::Truncated),
        ("all of the header but a byte", cut_to(HEADER - 1), Refusal::Truncated),
        ("a header alone", cut_to(HEADER), Refusal::Truncated),
        ("half of the code", cut_to(HEADER + 300), Refusal::Truncated),
        ("the last word missing", cut_to(whole - 4), Refusal::Truncated),
        ("the last byte missing", cut_to(whole - 1), Refusal::Truncated),
        ("a byte too many", bytes(|bytes| bytes.push(0xFF)), Refusal::Excess),
        ("the image twice", bytes(|bytes| bytes.extend(image_b().bytes())), Refusal::Excess),
        ("one word longer than the area", long(4), Refusal::TooLong),
        ("much longer than the area", long(100_000), Refusal::TooLong),
    ]
}

fn headers() -> Vec<Kind> {
    let counter = Refusal::Counter { least: 5 };
    let board = Refusal::Board { expected: BOARD };
    let hardware = Refusal::Hardware { revision: REVISION };
    vec![
        ("erased flash", vec![0xFF; 1200], Refusal::UnknownFormat),
        ("zeros", vec![0; 1200], Refusal::UnknownFormat),
        ("noise", noise(9, 1200), Refusal::UnknownFormat),
        ("code without a header", image_b().code, Refusal::UnknownFormat),
        ("an ELF file", [b"\x7fELF\x01\x01\x01".to_vec(), noise(3, 1193)].concat(), Refusal::UnknownFormat),
        ("another magic number", header(flip(0)), Refusal::UnknownFormat),
        ("the format before", header(put(4, 1)), Refusal::UnknownFormat),
        ("a bit of the header flipped", bytes(flip(17)), Refusal::HeaderCrc),
        ("a bit of the reserved bytes flipped", bytes(flip(300)), Refusal::HeaderCrc),
        ("a bit of the header's CRC flipped", bytes(flip(HEADER - 1)), Refusal::HeaderCrc),
        ("reserved bytes in use", header(put(300, 1)), Refusal::HeaderContent),
        ("reserved bytes in use behind the version", header(put(20, 8 << 16)), Refusal::HeaderContent),
        ("a certificate of no generation", header(put(36 + 8, 1)), Refusal::HeaderContent),
        (
            "a root certificate of no generation",
            certified(1, 0, |bytes| put(140 + 8, 1)(bytes)),
            Refusal::HeaderContent,
        ),
        ("a generation that cannot be kept", certified(64, 64, |_| ()), Refusal::HeaderContent),
        ("a release key of another root key", certified(17, 0, |_| ()), Refusal::HeaderContent),
        ("a root key without a release key", header(put(140, 16)), Refusal::HeaderContent),
        ("a counter that cannot be kept", signed(|about| about.counter = 33), Refusal::HeaderContent),
        (
            "a counter that rises too far",
            signed(|about| about.counter = 17),
            Refusal::CounterStep { most: 16 },
        ),
        ("no code by the header", header(put(24, 0)), Refusal::HeaderContent),
        ("no whole number of words", header(put(24, 618)), Refusal::HeaderContent),
        ("a length beyond the area", header(put(24, 10_000)), Refusal::TooLong),
        ("the greatest length", header(put(24, u32::MAX - 3)), Refusal::TooLong),
        ("a length that is longer than the code", header(put(24, 624)), Refusal::Truncated),
        ("a length that is shorter than the code", header(put(24, 616)), Refusal::Excess),
        ("another board", signed(|about| about.board += 1), board),
        ("other hardware", signed(|about| about.hardware = !(1 << REVISION)), hardware),
        ("no hardware at all", signed(|about| about.hardware = 0), hardware),
        ("a lower security counter", signed(|about| about.counter = 4), counter),
        ("the lowest security counter", signed(|about| about.counter = 0), counter),
    ]
}

/// The image with unsigned certificates of these generations, and good sums.
fn certified(release: u32, root: u32, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    header(|bytes| {
        put(36, release)(bytes);
        put(140, root)(bytes);
        change(bytes);
    })
}

fn contents() -> Vec<Kind> {
    let last = image_b().bytes().len() - 1;
    let swapped = bytes(|bytes| bytes[HEADER..HEADER + 512].rotate_left(256));
    let other_code = header(|bytes| {
        flip(HEADER + 8)(bytes);
        let crc = crc_of(&bytes[HEADER..]);
        put(28, crc)(bytes);
    });
    vec![
        ("the first bit of the code", bytes(flip(HEADER)), Refusal::CodeCrc),
        ("the last byte of the code", bytes(flip(last)), Refusal::CodeCrc),
        ("two chunks in the wrong order", swapped, Refusal::CodeCrc),
        ("another CRC of the code", header(flip(28)), Refusal::CodeCrc),
        ("other code with its CRC", other_code, Refusal::Signature),
        ("a newer version by hand", header(put(16, 9)), Refusal::Signature),
        ("a higher counter by hand", header(put(32, 6)), Refusal::Signature),
        ("more hardware by hand", header(put(12, u32::MAX)), Refusal::Signature),
        ("a certificate by hand", certified(1, 0, |_| ()), Refusal::Signature),
        ("certificates by hand", certified(17, 16, |_| ()), Refusal::Signature),
    ]
}

fn signatures() -> Vec<Kind> {
    let b = image_b();
    let stranger = b.clone().signed_by(&salty::Keypair::from(&[9; 32]));
    let transplanted = Image { header: b.header.with_signature(*image_a().header.signature()), ..b.clone() };
    let plain = keys().sign(&[&b.header.signed_part()[..], &b.code].concat());
    let of_hash = keys().sign(&b.hash());
    let context = keys().sign_prehashed(&b.hash(), Some(b"another purpose"));
    let no_context = keys().sign_prehashed(&b.hash(), None);
    let with = |signature| b.clone().with_signature(signature).bytes();
    let malleable = header(|bytes| add_order(&mut bytes[S..S + 32]));
    let all = [
        ("not signed", header(|bytes| bytes[SIGNED_LEN..HEADER].fill(0))),
        ("the signature erased", header(|bytes| bytes[SIGNED_LEN..HEADER].fill(0xFF))),
        ("a bit of R flipped", header(flip(SIGNED_LEN))),
        ("a bit of S flipped", header(flip(S))),
        ("R and S exchanged", header(|bytes| bytes[SIGNED_LEN..HEADER].rotate_left(32))),
        ("S not reduced (RFC 8032, 5.1.7)", malleable),
        ("the key of a stranger", stranger.bytes()),
        ("the root key of the node", b.clone().signed_by(&key_number(1)).bytes()),
        ("the signature of another image", transplanted.bytes()),
        ("plain Ed25519", with(plain)),
        ("plain Ed25519 of the hash", with(of_hash)),
        ("another context", with(context)),
        ("no context", with(no_context)),
    ];
    all.map(|(name, bytes)| (name, bytes, Refusal::Signature)).to_vec()
}

/// Adds the order of the base point, which gives an equivalent number.
fn add_order(s: &mut [u8]) {
    const ORDER: [u8; 32] = [
        0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE, 0x14, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10,
    ];
    let mut carry = 0;
    for (byte, add) in s.iter_mut().zip(ORDER) {
        let sum = u16::from(*byte) + u16::from(add) + carry;
        (*byte, carry) = ((sum & 0xFF) as u8, sum >> 8);
    }
}

fn kinds() -> Vec<Kind> {
    [lengths(), headers(), contents(), signatures()].concat()
}

#[test]
fn every_kind_is_refused_with_its_code_and_the_application_starts_as_before() {
    let before = flash_with(&image_a(), 1);
    let area: Area = target().layout.application();
    let (start, end) = (area.start() as usize, area.end() as usize);
    for (name, image, refusal) in kinds() {
        let mut flash = before.clone();
        let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
        assert!(download(&mut updater, &image).is_err(), "{name}");
        assert_eq!(updater.status(), Status::refused(refusal), "{name}");
        assert_eq!(updater.install(), Err(Refusal::Unspecified), "{name}: nothing to install");
        assert_eq!(flash.bytes()[start..end], before.bytes()[start..end], "{name}");
        assert_starts(&mut flash, &image_a());
    }
    println!("{} kinds of images refused", kinds().len());
    assert!(kinds().len() >= 20);
}

#[test]
fn a_client_that_does_not_say_the_size_is_refused_the_same() {
    for (name, image, refusal) in lengths() {
        let mut flash = flash_with(&image_a(), 1);
        let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
        updater.clear().unwrap();
        run(&mut updater).unwrap();
        updater.begin(None).unwrap();
        let outcome =
            image.chunks(7).try_for_each(|piece| updater.receive(piece)).and_then(|()| updater.finish());
        assert_eq!(outcome, Err(refusal), "{name}");
        assert_starts(&mut flash, &image_a());
    }
}

#[test]
fn every_bad_image_of_the_table_is_good_without_its_change() {
    for image in [bytes(|_| ()), header(|_| ()), signed(|_| ())] {
        assert_eq!(image, image_b().bytes());
    }
    let mut flash = flash_with(&image_a(), 1);
    update(&mut flash, &image_b().bytes()).unwrap();
    assert_starts(&mut flash, &image_b());
    assert_eq!(CONTEXT, b"CANopen node image 1");
}
