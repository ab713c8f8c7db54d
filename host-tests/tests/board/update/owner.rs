//! The bootloader as built by its owner: two keys of the owner, without the feature `development`.

use ed25519_dalek::SigningKey;
use host_tests::watch::expects;
use monitor::Rule;
use sign::image::Image;
use sign::key;
use update::Description;

use super::bench::{BOOT, Bench, DEVICE_TYPE, HEADER, version_a, version_b};
use crate::support::{SECOND, world_of};

/// The secret halves of the keys that `cargo xtask` builds this bootloader with.
const OWNER: [[u8; 32]; 2] = [[0x42; 32], [0x43; 32]];
/// Code in 1F57h for an image with a revoked key.
const REVOKED: u8 = 71;
/// Code in 1F57h for an image signed with an unknown key.
const SIGNATURE: u8 = 67;

fn bench() -> Bench {
    let mut bench = Bench::with(world_of("bootloader-owner", "--bitrate 1000"), 1_000_000, 1);
    bench.run(SECOND);
    bench
}

/// The code of an image in another image that names this key, and is signed with it.
pub(super) fn signed_by_owner(image: &Image, key: u8, revokes: u8) -> Image {
    let about = Description { key, revokes, ..*image.header.description() };
    Image::sign(about, image.code.clone(), &SigningKey::from_bytes(&OWNER[usize::from(key)])).unwrap()
}

#[test]
fn it_was_built_with_the_owner_s_keys() {
    let digits = OWNER.map(|secret| {
        let variable = key::variable(&SigningKey::from_bytes(&secret));
        variable.split_once('=').unwrap().1.to_owned()
    });
    assert!(include_str!("owner-keys.hex").lines().eq(digits));
}

#[test]
fn it_takes_what_its_owner_has_signed_and_nothing_else() {
    let mut bench = bench();
    // The application on the emulated board is signed with the development key: this bootloader does not start it.
    assert_eq!(bench.settled().code, SIGNATURE);
    bench.clear();
    assert!(bench.download(&version_b(0).to_bytes()).is_err() || bench.wait_for_flash().code != 0);
    assert_eq!(bench.settled().code, SIGNATURE, "the development key is the key of a stranger");
    bench.clear();
    let image = signed_by_owner(&version_a(), 0, 0);
    bench.download(&image.to_bytes()).unwrap();
    bench.wait_for_flash();
    assert_eq!(bench.start(), image.header.code_crc());
}

/// The second key revokes the first one: from the first start after the confirmation of the revoking image on.
#[test]
fn one_of_its_keys_revokes_the_other_one() {
    let _expected = expects([Rule::SdoProtocol]);
    let mut bench = bench();
    let take = |bench: &mut Bench, image: &Image| {
        bench.clear();
        bench.download(&image.to_bytes()).is_ok() && bench.wait_for_flash().code == 0
    };
    let first = signed_by_owner(&version_a(), 0, 0);
    assert!(take(&mut bench, &first));
    assert_eq!(bench.start(), first.header.code_crc());
    bench.confirm();
    bench.stop();
    let second = signed_by_owner(&version_b(0), 1, 1);
    assert!(take(&mut bench, &second));
    assert_eq!(bench.start(), second.header.code_crc());
    bench.run(SECOND * 10);
    bench.power_cycle();
    assert_eq!(bench.identification_of_running(), second.header.code_crc());
    bench.stop();
    assert!(!take(&mut bench, &first));
    assert_eq!((bench.settled().code, bench.settled().detail), (REVOKED, 0));
    // The image does not start either when a debugger has written it.
    bench.machine().write(HEADER, &first.to_bytes()).unwrap();
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
}
