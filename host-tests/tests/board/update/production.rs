//! The bootloader as its owner builds it: feature `production`, a key of the owner's.

use ed25519_dalek::SigningKey;
use sign::image::Image;
use sign::key;

use super::bench::{Bench, version_a, version_b};
use crate::support::{SECOND, world_of};

/// The secret half of the key that `cargo xtask` builds this bootloader with.
const OWNER: [u8; 32] = [0x42; 32];
/// What 1F57h reads after an image that another key has signed.
const SIGNATURE: u8 = 67;

fn bench() -> Bench {
    let mut bench = Bench::with(world_of("bootloader-production", "--bitrate 1000"), 1_000_000, 1);
    bench.run(SECOND);
    bench
}

fn signed_by_owner(image: &Image) -> Image {
    Image::sign(*image.header.description(), image.code.clone(), &SigningKey::from_bytes(&OWNER)).unwrap()
}

#[test]
fn it_was_built_with_the_owner_s_key() {
    let owner = SigningKey::from_bytes(&OWNER);
    assert_eq!(key::variable(&owner).split('=').nth(1), Some(include_str!("owner-key.hex").trim()));
}

#[test]
fn it_takes_what_its_owner_has_signed_and_nothing_else() {
    let mut bench = bench();
    // The application that the emulated board brings is signed with the development key: this bootloader does not start it.
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
