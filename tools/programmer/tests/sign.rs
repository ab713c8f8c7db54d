//! Tests that a node accepts the images that the tool signs.

use bsp::flash::update_layout::LAYOUT;
use programmer::sign::image::Image;
use programmer::sign::{code, key, key_list};
use update::key::{DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY, HAS_PUBLISHED_KEY, KeyList, PUBLIC_KEYS, Rank};
use update::mock::MockFlash;
use update::{Decision, Description, HEADER_LEN, Next, Start, Status, Target, Updater, Version, boot};

const SECTORS: [usize; 8] = [16, 16, 16, 16, 64, 128, 128, 128];

fn description() -> Description {
    let version = Version { major: 1, minor: 2, patch: 3 };
    Description { board: 0x8271, hardware: 1, version, counter: 1, ..Description::default() }
}

fn target() -> Target {
    Target { layout: LAYOUT, board: 0x8271, hardware: 0, keys: &PUBLIC_KEYS }
}

/// Updates a node with the flash of the chip. Returns the value of 1F57h at the end.
fn update(flash: &mut MockFlash, image: &[u8]) -> Status {
    let mut updater = Updater::new(flash, target(), Status::GOOD);
    let poll = |updater: &mut Updater<&mut MockFlash>| while updater.poll() != Next::Nothing {};
    updater.clear().unwrap();
    poll(&mut updater);
    updater.begin(u32::try_from(image.len()).ok()).unwrap();
    image.chunks(889).for_each(|piece| updater.receive(piece).unwrap());
    updater.finish().unwrap();
    poll(&mut updater);
    if updater.status() == Status::GOOD {
        updater.install().unwrap();
        poll(&mut updater);
    }
    updater.status()
}

fn flash() -> MockFlash {
    MockFlash::new(&SECTORS.map(|kib| kib * 1024), 0)
}

#[test]
fn a_node_runs_images_of_the_development_key_up_to_the_longest() {
    for len in [4, 10_000, code::most()] {
        let code = (0..len).map(|i| (i * 7 + i / 256) as u8).collect();
        let image = Image::sign(description(), code, &key::development()).unwrap();
        let mut flash = flash();
        assert_eq!(update(&mut flash, &image.to_bytes()), Status::GOOD);
        assert_eq!(boot(&mut flash, &target(), Start::default()), Decision::Start(image.header));
    }
}

#[test]
fn a_node_refuses_images_of_another_key() {
    let image = Image::sign(description(), vec![1; 64], &key::random().unwrap()).unwrap();
    assert_eq!(update(&mut flash(), &image.to_bytes()).code, 67);
}

#[test]
fn the_development_key_is_the_one_in_the_file_and_in_the_bootloader() {
    let key = key::development();
    assert_eq!(std::fs::read_to_string(key::development_path()).unwrap(), key::pem(&key).unwrap());
    assert_eq!(key::read(&key::development_path()).unwrap(), key);
    assert_eq!(
        key.verifying_key().to_bytes(),
        DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY,
        "{}",
        key::variable(&key, Rank::Release)
    );
    assert!(key::is_development(&key));
    assert!(!key::is_development(&key::random().unwrap()));
    assert!(HAS_PUBLISHED_KEY && PUBLIC_KEYS == [DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY; 3]);
}

#[test]
fn a_key_file_reads_back_and_is_never_overwritten() {
    let path = std::env::temp_dir().join(format!("sign-test-{}.pem", std::process::id()));
    let key = key::random().unwrap();
    key::write(&key, &path).unwrap();
    assert_eq!(key::read(&path).unwrap(), key);
    assert!(key::write(&key, &path).is_err());
    std::fs::remove_file(path).unwrap();
}

#[test]
fn an_image_file_reads_back() {
    let image = Image::sign(description(), vec![5; 400], &key::development()).unwrap();
    let bytes = image.to_bytes();
    let again = Image::read(&bytes).unwrap();
    assert_eq!(again, image);
    assert!(again.is_signed_by(&key::development().verifying_key()));
    assert!(!again.is_signed_by(&key::random().unwrap().verifying_key()));
    for len in [0, HEADER_LEN - 1, HEADER_LEN, bytes.len() - 1] {
        assert!(Image::read(&bytes[..len]).is_err());
    }
    let mut damaged = bytes;
    damaged[HEADER_LEN + 9] ^= 1;
    assert_eq!(Image::read(&damaged).unwrap_err().to_string(), "the CRC of the code is wrong");
}

#[test]
fn the_same_input_gives_the_same_image() {
    let image = || Image::sign(description(), vec![5; 400], &key::development()).unwrap().to_bytes();
    assert_eq!(image(), image());
}

/// A program header of type LOAD: offset in the file, physical address, length.
fn segment(offset: u32, address: u32, len: u32) -> Vec<u8> {
    [1, offset, address, address, len, len, 5, 4].iter().flat_map(|word: &u32| word.to_le_bytes()).collect()
}

/// An ELF file for Arm with these segments. The content of each segment is the file itself, from byte 0 on.
fn elf(segments: &[Vec<u8>]) -> Vec<u8> {
    let count = u16::try_from(segments.len()).unwrap();
    let head: [&[u8]; 4] =
        [b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0", &[2, 0, 40, 0, 1, 0, 0, 0], &[0; 4], &[52, 0, 0, 0]];
    let rest = [0, 0, 0, 0, 52, 32, count, 40, 0, 0].map(u16::to_le_bytes).concat();
    [head.concat(), rest, segments.concat()].concat()
}

#[test]
fn segments_of_an_elf_file_lie_where_they_are_loaded() {
    let start = code::start();
    assert_eq!(start, 0x0802_0200);
    let file = elf(&[segment(0, start, 16), segment(16, start + 20, 3)]);
    let code = code::read(&file).unwrap();
    assert_eq!(code, [&file[..16], &[0xFF; 4], &file[16..19], &[0xFF]].concat());
}

#[test]
fn a_file_without_an_application_is_refused() {
    let (start, end) = (code::start(), code::start() + u32::try_from(code::most()).unwrap());
    for (file, words) in [
        (elf(&[segment(0, 0x0800_0000, 16)]), "outside of the application area"),
        (elf(&[segment(0, start - 4, 16)]), "outside of the application area"),
        (elf(&[segment(0, end - 12, 16)]), "outside of the application area"),
        (elf(&[segment(0, u32::MAX - 3, 16)]), "outside of the application area"),
        (elf(&[segment(1000, start, 16)]), "not in the file"),
        (elf(&[]), "there is no code"),
        (elf(&[segment(0, start, 16)])[..30].to_vec(), "a damaged ELF file"),
        (Vec::new(), "there is no code"),
        (vec![0; code::most() + 1], "room for 130048"),
    ] {
        let error = format!("{:#}", code::read(&file).unwrap_err());
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(code::read(&[1, 2, 3]).unwrap(), [1, 2, 3, 0xFF]);
}

/// A bootloader with the development key in all ranks takes an image of the release key that the list certifies.
#[test]
fn a_node_runs_images_of_the_release_key_of_a_key_list() {
    let (by, root, release) = (key::development(), key::random().unwrap(), key::random().unwrap());
    let roots = key_list::with_root(&root.verifying_key(), 1, &by).unwrap();
    let of_root = key_list::with_release(roots, &release.verifying_key(), 2, 0, &root).unwrap();
    let of_bootloader =
        key_list::with_release(KeyList::default(), &release.verifying_key(), 1, 0, &by).unwrap();
    let mut flash = flash();
    for (generation, keys) in [(1, of_bootloader), (18, of_root)] {
        assert_eq!(key_list::read(&keys.encode()).unwrap(), keys);
        assert_eq!(keys.generation(), generation);
        let image = Image::sign(Description { keys, ..description() }, vec![1; 64], &release).unwrap();
        assert_eq!(update(&mut flash, &image.to_bytes()), Status::GOOD);
        assert_eq!(boot(&mut flash, &target(), Start::default()), Decision::Start(image.header));
        update::Trial::confirm(&mut flash, &LAYOUT).unwrap();
        boot(&mut flash, &target(), Start::default());
    }
    assert!(key_list::with_release(KeyList::default(), &release.verifying_key(), 0, 0, &by).is_err());
    assert!(key_list::with_release(KeyList::default(), &release.verifying_key(), 16, 0, &by).is_err());
    assert!(key_list::with_release(roots, &release.verifying_key(), 1, 0, &by).is_err(), "another root key");
    assert!(key_list::with_root(&root.verifying_key(), 4, &by).is_err());
}
