//! The ranks of the keys: exchange and revocation of a release key and of a root key, and what a thief of each can do.

use update::key::KeyList;
use update::mock::MockFlash;
use update::{COUNTER_STEP, Description, Proof, Refusal, Status, Updater, application};

use crate::bench::{APPLICATION, SECTORS, flash_with};
use crate::bench::{
    Image, assert_starts, certificate, confirm, description, download, image_b, is_thorough, key_number,
    target, update,
};

/// Keys of the bootloader.
const RELEASE: u8 = 0;
const ROOT: u8 = 1;
const RECOVERY: u8 = 2;
/// Keys that a certificate brings.
const NEXT_RELEASE: u8 = 3;
const NEXT_ROOT: u8 = 4;
const THIEF: u8 = 5;

fn image(version: u16, counter: u32, keys: KeyList, by: u8) -> Image {
    let about = Description { keys, ..description(version, counter) };
    Image::new(about, 404).signed_by(&key_number(by))
}

fn release(generation: u32, key: u8, by: u8) -> KeyList {
    KeyList { release: Some(certificate(generation, 0, key, by)), root: None }
}

/// A list with another root key, signed with `by`, and its release key of this number.
fn both(root: u32, by: u8, number: u32, key: u8) -> KeyList {
    let root = certificate(root, 0, NEXT_ROOT, by);
    KeyList { release: Some(certificate(root.generation + number, 0, key, NEXT_ROOT)), root: Some(root) }
}

fn refusal(flash: &MockFlash, image: &Image) -> Status {
    let mut flash = flash.clone();
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    assert!(download(&mut updater, &image.bytes()).is_err());
    updater.status()
}

fn take(flash: &mut MockFlash, image: &Image) {
    update(flash, &image.bytes()).unwrap();
    assert_starts(flash, image);
    confirm(flash);
    assert_starts(flash, image);
}

/// An application that a debugger has written.
fn put(flash: &MockFlash, image: &Image) -> MockFlash {
    let mut flash = flash.clone();
    for (at, byte) in image.bytes().into_iter().enumerate() {
        flash.disturb(APPLICATION + at, |_| byte);
    }
    flash
}

fn is_revoked(flash: &MockFlash, image: &Image, generation: u32) {
    let refusal_of_it = Refusal::Revoked { generation };
    assert_eq!(refusal(flash, image), Status::refused(refusal_of_it));
    let found = application(&mut put(flash, image), &target(), Proof::None);
    assert_eq!(found, Err(refusal_of_it), "written by a debugger");
}

#[test]
fn a_stolen_release_key_is_revoked_by_a_list_of_the_root_key() {
    let mut flash = flash_with(&image(1, 5, KeyList::default(), RELEASE), 1);
    let stolen = image(2, 5, KeyList::default(), RELEASE);
    take(&mut flash, &stolen);
    let mut on_trial = flash.clone();
    let next = image(3, 5, release(1, NEXT_RELEASE, ROOT), NEXT_RELEASE);
    update(&mut on_trial, &next.bytes()).unwrap();
    assert_starts(&mut on_trial, &next);
    take(&mut flash, &next);
    is_revoked(&flash, &stolen, 1);
    // The next release needs no root key.
    take(&mut flash, &image(4, 5, release(1, NEXT_RELEASE, ROOT), NEXT_RELEASE));
    // A third release key revokes the second one.
    take(&mut flash, &image(5, 5, release(2, 6, ROOT), 6));
    is_revoked(&flash, &next, 2);
}

#[test]
fn a_stolen_root_key_is_revoked_by_a_list_of_the_recovery_key_whatever_the_thief_has_signed() {
    let mut flash = flash_with(&image(1, 5, KeyList::default(), RELEASE), 1);
    // The thief of the root key has a release key of the last generation of this root key.
    take(&mut flash, &image(2, 5, release(15, THIEF, ROOT), THIEF));
    let next = image(3, 5, both(16, RECOVERY, 0, NEXT_RELEASE), NEXT_RELEASE);
    take(&mut flash, &next);
    is_revoked(&flash, &image(4, 5, release(15, THIEF, ROOT), THIEF), 16);
    is_revoked(&flash, &image(4, 5, KeyList::default(), RELEASE), 16);
    // The new root key replaces the release key.
    take(&mut flash, &image(4, 5, both(16, RECOVERY, 1, THIEF + 1), THIEF + 1));
    is_revoked(&flash, &next, 17);
}

/// No key replaces a key of its own rank or above.
#[test]
fn a_key_signs_for_the_rank_below_it_only() {
    let flash = flash_with(&image(1, 5, KeyList::default(), RELEASE), 1);
    let signature = Status::refused(Refusal::Signature);
    for keys in [
        release(1, THIEF, RELEASE),
        release(1, THIEF, RECOVERY),
        release(1, THIEF, THIEF),
        both(16, RELEASE, 1, THIEF),
        both(16, ROOT, 1, THIEF),
        both(16, NEXT_ROOT, 1, THIEF),
    ] {
        assert_eq!(refusal(&flash, &image(2, 5, keys, THIEF)), signature, "{keys:?}");
        let mut written = put(&flash, &image(2, 5, keys, THIEF));
        assert_eq!(application(&mut written, &target(), Proof::None), Err(Refusal::Signature));
    }
    // The release key of the root key that was replaced is not that of the list.
    let keys = both(16, RECOVERY, 1, NEXT_RELEASE);
    for by in [RELEASE, ROOT, RECOVERY, NEXT_ROOT] {
        assert_eq!(refusal(&flash, &image(2, 5, keys, by)), signature, "{by}");
    }
    // A certificate of the release key is not valid for a root key, and the other way round.
    let of_release = certificate(16, 0, NEXT_ROOT, ROOT);
    let keys = KeyList { release: Some(certificate(17, 0, THIEF, NEXT_ROOT)), root: Some(of_release) };
    assert_eq!(refusal(&flash, &image(2, 5, keys, THIEF)), signature);
}

#[test]
fn every_changed_bit_of_a_certificate_is_refused() {
    let keys = both(16, RECOVERY, 3, NEXT_RELEASE);
    let good = image(2, 5, keys, NEXT_RELEASE);
    let mut flash = flash_with(&image(1, 5, KeyList::default(), RELEASE), 1);
    let step = if is_thorough() { 1 } else { 29 };
    for bit in (0..8 * KeyList::LEN).step_by(step) {
        let mut bytes = keys.encode();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let about = Description { keys: KeyList::from_bytes(&bytes), ..description(2, 5) };
        // A header whose generations do not fit is not valid.
        let Some(header) = update::Header::describe(about, &good.code) else { continue };
        let changed = Image { header, code: good.code.clone() }.signed_by(&key_number(NEXT_RELEASE));
        let found = application(&mut put(&flash, &changed), &target(), Proof::None);
        assert_eq!(found, Err(Refusal::Signature), "bit {bit}");
    }
    take(&mut flash, &good);
}

/// The release key raises the counter by 16 with an image, the root key as far as there are marks.
#[test]
fn the_release_key_raises_the_counter_by_a_bounded_step() {
    let mut flash = MockFlash::new(&SECTORS, 1);
    take(&mut flash, &image(1, 5, KeyList::default(), RELEASE));
    let by_release = |counter| image(2, counter, KeyList::default(), RELEASE);
    take(&mut flash.clone(), &by_release(5 + COUNTER_STEP));
    let step = Status::refused(Refusal::CounterStep { most: 5 + COUNTER_STEP });
    assert_eq!(refusal(&flash, &by_release(5 + COUNTER_STEP + 1)), step);
    let highest = target().layout.highest_counter();
    let by_root = |counter| {
        let certificate = certificate(1, counter, NEXT_RELEASE, ROOT);
        image(2, highest, KeyList { release: Some(certificate), root: None }, NEXT_RELEASE)
    };
    let step = Status::refused(Refusal::CounterStep { most: highest - 1 });
    assert_eq!(refusal(&flash, &by_root(highest - COUNTER_STEP - 1)), step);
    take(&mut flash.clone(), &by_root(highest - COUNTER_STEP));
    take(&mut flash.clone(), &by_root(u32::MAX));
}

/// The first program of a node is not bounded where a programmer writes it.
#[test]
fn a_programmer_writes_any_counter() {
    let flash = MockFlash::new(&SECTORS, 1);
    let first = image(1, 30, KeyList::default(), RELEASE);
    assert_starts(&mut put(&flash, &first), &first);
    assert_eq!(image_b().header.generation(), 0);
}
