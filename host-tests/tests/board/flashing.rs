//! The image that `cargo xtask flash` writes into a board on a bench, compared with the flash of the emulated board.

use std::ops::Range;

use crc::{CRC_32_ISO_HDLC, Crc};
use ed25519_dalek::SigningKey;
use programmer::flash::Content;
use programmer::sign::key;

use crate::support::{firmware, images, world};

const FLASH: usize = 0x0800_0000;
/// The pages of the parameter store, which no programmer writes (memory.x).
const PARAMETERS: Range<usize> = 0x8000..0x1_0000;

fn content(key: SigningKey) -> Result<Content, String> {
    content_of("bootloader", key, &[])
}

fn content_of(name: &str, key: SigningKey, others: &[SigningKey]) -> Result<Content, String> {
    let bootloader = std::fs::read(images().join(name)).unwrap();
    let others = others.iter().map(SigningKey::verifying_key).collect();
    Content::new(&bootloader, &firmware(), key, others).map_err(|error| format!("{error:#}"))
}

/// The first line says which bootloader is written and what it starts. With the three keys of an owner it is the owner's.
#[test]
fn the_first_line_names_the_bootloader_and_its_programs() {
    let first_line = |content: Content| content.to_string().lines().next().unwrap().to_owned();
    let development = first_line(content(key::development()).unwrap());
    assert_eq!(
        development,
        "DEVELOPMENT bootloader: it starts every program, signed or not; not for production"
    );
    let [first, others @ ..] =
        [[0x42; 32], [0x43; 32], [0x44; 32]].map(|secret| SigningKey::from_bytes(&secret));
    let owner = first_line(content_of("bootloader-owner", first.clone(), &others).unwrap());
    let [root, recovery] = &others;
    let [first, root, recovery] = [&first, root, recovery].map(key::public_digits);
    assert_eq!(
        owner,
        format!(
            "bootloader of an owner: it starts only programs signed with the key of {first}, which may be replaced by that of \
             {root}, which may be replaced by that of {recovery}"
        )
    );
}

#[test]
fn a_bootloader_with_another_root_key_is_not_written() {
    let other = SigningKey::from_bytes(&[7; 32]);
    let refused = content_of("bootloader-owner", SigningKey::from_bytes(&[0x42; 32]), &[other]).unwrap_err();
    assert!(refused.contains("another key"), "{refused}");
}

fn emulated() -> Vec<u8> {
    world("--bitrate 1000").boards()[0].flash()
}

#[test]
fn a_flashed_board_has_the_flash_of_the_emulated_board() {
    let emulated = emulated();
    let mut written = vec![0xFF; emulated.len()];
    for part in content(key::development()).unwrap().parts() {
        let at = part.address as usize - FLASH;
        written[at..at + part.bytes.len()].copy_from_slice(&part.bytes);
    }
    assert!(written[PARAMETERS].iter().all(|byte| *byte == 0xFF), "parameters are not written");
    written[PARAMETERS].copy_from_slice(&emulated[PARAMETERS]);
    let differs = (0..written.len()).find(|at| written[*at] != emulated[*at]);
    assert_eq!(differs.map(|at| format!("{:#010x}", FLASH + at)), None);
}

/// A line of a dry run: `bootloader  0x08000000..0x08000080     128 bytes, CRC-32 0x01234567`.
fn range_and_crc(line: &str) -> Option<(Range<usize>, u32)> {
    let number = |text: &str| usize::from_str_radix(text.strip_prefix("0x")?, 16).ok();
    let (start, end) = line.split_whitespace().nth(1)?.split_once("..")?;
    let crc = number(line.split_whitespace().next_back()?)?;
    Some((number(start)?..number(end)?, u32::try_from(crc).ok()?))
}

#[test]
fn a_dry_run_prints_the_ranges_with_their_contents() {
    let says = content(key::development()).unwrap().to_string();
    let emulated = emulated();
    let parts: Vec<_> = says.lines().filter_map(range_and_crc).collect();
    println!("{says}");
    assert_eq!(parts.len(), 3, "start-up code and program of the bootloader, and the application");
    for (range, crc) in parts {
        let bytes = &emulated[range.start - FLASH..range.end - FLASH];
        assert_eq!(Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes), crc, "{range:x?}");
    }
    assert!(
        says.contains(env!("CARGO_PKG_VERSION")) && says.contains("published in the repository"),
        "{says}"
    );
}

#[test]
fn a_key_that_the_bootloader_does_not_trust_is_refused_before_anything_is_written() {
    let refused = content(SigningKey::from_bytes(&[7; 32])).unwrap_err();
    assert!(refused.contains("another key"), "{refused}");
}
