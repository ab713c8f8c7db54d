//! Encoding and parsing of the header.

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use update::key::{Certificate, GENERATIONS, KeyList, root_generation};
use update::{Description, HEADER_LEN, Header, Refusal, SIGNATURE_LEN, SIGNED_LEN, Version};

fn description() -> impl Strategy<Value = Description> {
    let version = any::<[u16; 3]>().prop_map(|[major, minor, patch]| Version { major, minor, patch });
    (any::<u32>(), any::<u32>(), version, any::<u32>(), keys()).prop_map(
        |(board, hardware, version, counter, keys)| Description { board, hardware, version, counter, keys },
    )
}

fn certificate() -> impl Strategy<Value = Certificate> {
    (any::<u32>(), any::<[u8; 32]>(), signature()).prop_map(|(counter, key, signature)| Certificate {
        generation: 0,
        counter,
        key,
        signature,
    })
}

fn keys() -> impl Strategy<Value = KeyList> {
    (0..GENERATIONS, certificate(), certificate()).prop_map(|(generation, release, root)| {
        let of = |generation, it| (generation != 0).then_some(Certificate { generation, ..it });
        KeyList { release: of(generation, release), root: of(root_generation(generation), root) }
    })
}

fn signature() -> impl Strategy<Value = [u8; SIGNATURE_LEN]> {
    any::<[[u8; 32]; 2]>().prop_map(|halves| halves.concat().try_into().unwrap())
}

fn header() -> impl Strategy<Value = Header> {
    let code = prop::collection::vec(any::<[u8; 4]>(), 1..50).prop_map(|words| words.concat());
    (description(), code, signature()).prop_map(|(description, code, signature)| {
        Header::describe(description, &code).unwrap().with_signature(signature)
    })
}

/// 500 cases from a fixed seed.
fn check<T: std::fmt::Debug>(strategy: impl Strategy<Value = T>, test: impl Fn(T)) {
    let config = Config { cases: 500, failure_persistence: None, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let outcome = TestRunner::new_with_rng(config, rng).run(&strategy, |value| {
        test(value);
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn an_encoded_header_is_parsed() {
    check(header(), |header| assert_eq!(Header::parse(&header.encode()), Ok(header)));
}

#[test]
fn a_change_of_any_byte_is_refused() {
    check((header(), 0..HEADER_LEN, 1..=u8::MAX), |(header, at, change)| {
        let mut bytes = header.encode();
        bytes[at] ^= change;
        assert!(Header::parse(&bytes).is_err(), "byte {at}");
    });
}

#[test]
fn a_wrong_crc_and_a_wrong_content_have_different_codes() {
    check((header(), 8..HEADER_LEN, 1..=u8::MAX), |(header, at, change)| {
        let mut bytes = header.encode();
        bytes[at] ^= change;
        assert_eq!(Header::parse(&bytes), Err(Refusal::HeaderCrc), "byte {at}");
    });
}

/// Any accepted bytes, with a valid CRC over random content, equal the encoding of the parsed value.
#[test]
fn a_parsed_header_encodes_to_the_same_bytes() {
    let words = prop::collection::vec((0..HEADER_LEN / 4 - 1, any::<[u8; 4]>()), 0..3);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    check((header(), words), |(header, words)| {
        let mut bytes = header.encode();
        for (at, word) in words {
            bytes[at * 4..at * 4 + 4].copy_from_slice(&word);
        }
        let sum = crc.checksum(&bytes[..HEADER_LEN - 4]);
        bytes[HEADER_LEN - 4..].copy_from_slice(&sum.to_le_bytes());
        match Header::parse(&bytes) {
            Ok(header) => assert_eq!(header.encode(), bytes),
            Err(refusal) => assert!(matches!(refusal, Refusal::HeaderContent | Refusal::UnknownFormat)),
        }
    });
}

#[test]
fn noise_is_no_header() {
    let noise = prop::collection::vec(any::<u8>(), HEADER_LEN);
    check(noise, |bytes| {
        assert_eq!(Header::parse(&bytes.try_into().unwrap()), Err(Refusal::UnknownFormat));
    });
}

/// The layout printed in docs/update.md.
#[test]
fn the_fields_are_where_the_table_says() {
    let version = Version { major: 0x0102, minor: 0x0304, patch: 0x0506 };
    let of = |generation, counter, key, signature| {
        Some(Certificate { generation, counter, key: [key; 32], signature: [signature; 64] })
    };
    let keys = KeyList { release: of(0x23, 0x4142_4344, 1, 2), root: of(0x20, 0x5152_5354, 3, 4) };
    let numbers = Description { board: 0x1112_1314, hardware: 0x2122_2324, ..Description::default() };
    let about = Description { version, counter: 0x3132_3334, keys, ..numbers };
    let header = Header::describe(about, b"123456781234").unwrap().with_signature([0xA5; 64]);
    let bytes = header.encode();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!(&bytes[..8], b"CNFW\x02\0\0\0");
    assert_eq!((word(8), word(12)), (0x1112_1314, 0x2122_2324));
    assert_eq!(&bytes[16..24], [0x02, 0x01, 0x04, 0x03, 0x06, 0x05, 0, 0]);
    assert_eq!((word(24), word(28), word(32)), (12, header.code_crc(), 0x3132_3334));
    assert_eq!((word(36), word(40)), (0x23, 0x4142_4344));
    assert_eq!((&bytes[44..76], &bytes[76..140]), (&[1; 32][..], &[2; 64][..]));
    assert_eq!((word(140), word(144)), (0x20, 0x5152_5354));
    assert_eq!((&bytes[148..180], &bytes[180..244]), (&[3; 32][..], &[4; 64][..]));
    assert!(bytes[244..SIGNED_LEN].iter().all(|byte| *byte == 0));
    assert_eq!((SIGNED_LEN, &bytes[444..508]), (444, &[0xA5; 64][..]));
    assert_eq!(word(508), header.crc());
    assert_eq!(version.to_string(), "258.772.1286");
}

/// The check value of CRC-32/ISO-HDLC (catalogue of parametrised CRC algorithms), for a message of whole words.
#[test]
fn the_crc_is_the_one_of_zip() {
    let about = Description::default();
    assert_eq!(Header::describe(about, b"1234").unwrap().code_crc(), 0x9BE3_E0A3);
    assert!(Header::describe(about, b"123").is_none());
    assert!(Header::describe(about, b"").is_none());
}

#[test]
fn the_generation_of_a_release_key_is_that_of_its_root_key_and_a_number_below_16() {
    let of = |generation| {
        (generation != 0).then_some(Certificate { generation, counter: 0, key: [1; 32], signature: [2; 64] })
    };
    let header = |release, root| {
        let keys = KeyList { release: of(release), root: of(root) };
        Header::describe(Description { keys, ..Description::default() }, b"1234")
    };
    for (release, root) in (0..80).flat_map(|release| (0..80).map(move |root| (release, root))) {
        let fits = release < 64 && root == release / 16 * 16;
        assert_eq!(header(release, root).is_some(), fits, "{release} of {root}");
    }
}
