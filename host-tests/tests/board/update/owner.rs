//! The bootloader as built by its owner: release key, root key and recovery key, without the feature `development`.

use ed25519_dalek::{SigningKey, VerifyingKey};
use programmer::sign::image::Image;
use programmer::sign::{key, key_list};
use update::Description;
use update::key::{KeyList, Rank};

use super::bench::{BOOT, Bench, DEVICE_TYPE, HEADER, version_a, version_b};
use crate::support::{SECOND, world_of};

/// The secret halves of the keys that `cargo xtask` builds this bootloader with.
const OWNER: [[u8; 32]; 3] = [[0x42; 32], [0x43; 32], [0x44; 32]];
/// The secret halves of a release key and a root key that replace those.
const NEXT_RELEASE: [u8; 32] = [0x45; 32];
const NEXT_ROOT: [u8; 32] = [0x46; 32];
/// Code in 1F57h for an image with a revoked key.
const REVOKED: u8 = 71;
/// Code in 1F57h for an image whose counter rises too far.
const COUNTER_STEP: u8 = 74;
/// Code in 1F57h for an image signed with an unknown key.
const SIGNATURE: u8 = 67;

fn bench() -> Bench {
    let mut bench = Bench::with(world_of("bootloader-owner", "--bitrate 1000"), 1_000_000, 1);
    bench.run(SECOND);
    bench
}

/// The code of an image in an image that the release key of the owner has signed.
pub(super) fn signed_by_owner(image: &Image) -> Image {
    signed(image, KeyList::default(), OWNER[0])
}

fn signed(image: &Image, keys: KeyList, secret: [u8; 32]) -> Image {
    let about = Description { keys, ..image.header.description() };
    Image::sign(about, image.code.clone(), &SigningKey::from_bytes(&secret)).unwrap()
}

fn public(secret: [u8; 32]) -> VerifyingKey {
    SigningKey::from_bytes(&secret).verifying_key()
}

/// The list in which a root key certifies the next release key under this number.
fn list(before: KeyList, number: u32, root: [u8; 32]) -> KeyList {
    let root = SigningKey::from_bytes(&root);
    key_list::with_release(before, &public(NEXT_RELEASE), number, 0, &root).unwrap()
}

fn take(bench: &mut Bench, image: &Image) -> bool {
    bench.clear();
    bench.download(&image.to_bytes()).is_ok() && bench.wait_for_flash().code == 0
}

/// Takes an image, starts it, and confirms it. The next start records its counter and its keys.
fn confirmed(bench: &mut Bench, image: &Image) {
    assert!(take(bench, image), "{:?}", bench.settled());
    assert_eq!(bench.start(), image.header.code_crc());
    bench.confirm();
    bench.power_cycle();
    assert_eq!(bench.identification_of_running(), image.header.code_crc());
    bench.stop();
}

/// The image is refused, also where a debugger writes it.
fn is_revoked(bench: &mut Bench, image: &Image, generation: u16) {
    assert!(!take(bench, image));
    assert_eq!((bench.settled().code, bench.settled().detail), (REVOKED, generation));
    bench.machine().write(HEADER, &image.to_bytes()).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
}

#[test]
fn it_was_built_with_the_owner_s_keys() {
    let digits = OWNER.map(|secret| {
        let variable = key::variable(&SigningKey::from_bytes(&secret), Rank::Release);
        variable.split_once('=').unwrap().1.to_owned()
    });
    assert!(include_str!("owner-keys.hex").lines().eq(digits));
}

#[test]
fn the_bootloader_of_an_owner_accepts_only_the_owners_images() {
    let mut bench = bench();
    // The application on the emulated board is signed with the development key: this bootloader does not start it.
    assert_eq!(bench.settled().code, SIGNATURE);
    bench.clear();
    assert!(bench.download(&version_b(0).to_bytes()).is_err() || bench.wait_for_flash().code != 0);
    assert_eq!(bench.settled().code, SIGNATURE, "the development key is the key of a stranger");
    bench.clear();
    let image = signed_by_owner(&version_a());
    bench.download(&image.to_bytes()).unwrap();
    bench.wait_for_flash();
    assert_eq!(bench.start(), image.header.code_crc());
}

/// A thief has the release key. The root key certifies another one: from the first start after the confirmation of its first
/// image on, nothing that the stolen key has signed is accepted or started.
#[test]
fn a_stolen_release_key_is_revoked_in_the_field() {
    let mut bench = bench();
    let stolen = signed_by_owner(&version_a());
    confirmed(&mut bench, &stolen);
    // The thief certifies a key of its own.
    let thief = SigningKey::from_bytes(&OWNER[0]);
    let own = key_list::with_release(KeyList::default(), &public(NEXT_RELEASE), 1, 0, &thief).unwrap();
    assert!(!take(&mut bench, &signed(&version_b(0), own, NEXT_RELEASE)));
    assert_eq!(bench.settled().code, SIGNATURE);
    let next = signed(&version_b(0), list(KeyList::default(), 1, OWNER[1]), NEXT_RELEASE);
    confirmed(&mut bench, &next);
    is_revoked(&mut bench, &stolen, 1);
    confirmed(&mut bench, &next);
}

/// A thief has the root key too. The recovery key certifies another one.
#[test]
fn a_stolen_root_key_is_revoked_in_the_field() {
    let mut bench = bench();
    let stolen = signed(&version_a(), list(KeyList::default(), 15, OWNER[1]), NEXT_RELEASE);
    confirmed(&mut bench, &stolen);
    let roots = key_list::with_root(&public(NEXT_ROOT), 1, &SigningKey::from_bytes(&OWNER[2])).unwrap();
    let next = signed(&version_b(0), list(roots, 0, NEXT_ROOT), NEXT_RELEASE);
    confirmed(&mut bench, &next);
    is_revoked(&mut bench, &stolen, 16);
}

/// The release key raises the security counter by 16 with an image.
#[test]
fn the_release_key_raises_the_counter_by_a_bounded_step() {
    let mut bench = bench();
    let image = version_a();
    let about = Description { counter: 17, ..image.header.description() };
    let image = Image::sign(about, image.code, &SigningKey::from_bytes(&OWNER[0])).unwrap();
    assert!(!take(&mut bench, &image));
    assert_eq!((bench.settled().code, bench.settled().detail), (COUNTER_STEP, 16));
}
