//! The public keys of the bootloader, as given to its build.
//!
//! `cargo xtask sign key` makes a key pair and prints the variable for the build of the bootloader; docs/update.md
//! describes the ranks, and how to keep the secret halves.

pub use crate::certificate::{
    CERTIFICATE_LEN, Certificate, GENERATIONS, KEYS_CONTEXT, KeyList, RELEASES, root_generation,
};

/// Bytes of an Ed25519 public key.
pub const KEY_LEN: usize = 32;

/// The public half of the DEVELOPMENT key. Its secret half is in the repository
/// (`tools/programmer/keys/DEVELOPMENT-KEY-KNOWN-TO-EVERYBODY.pem`), so a node that trusts this key runs images signed by
/// anybody.
pub const DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY: [u8; KEY_LEN] = [
    0xFB, 0x87, 0x4B, 0xC8, 0xD1, 0x9E, 0xEB, 0x05, 0xB1, 0x01, 0x6F, 0x27, 0xC2, 0x7C, 0xCD, 0x9E, 0x98,
    0x53, 0x25, 0xCA, 0x80, 0xD8, 0x06, 0x8B, 0xDA, 0x9B, 0x5F, 0x44, 0xA3, 0x9F, 0xE4, 0x66,
];

/// The ranks of the keys, the lowest first. A key signs for the rank below it, and so replaces the key there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// Signs images.
    Release,
    /// Signs the certificate of a release key. It belongs to a place without a network.
    Root,
    /// Signs the certificate of a root key, when that is lost or known. It belongs to another place.
    Recovery,
}

/// Number of ranks.
pub const RANKS: usize = 3;

/// The keys of this bootloader by their rank: 64 hexadecimal digits each, in the variables `UPDATE_RELEASE_KEY`,
/// `UPDATE_ROOT_KEY` and `UPDATE_RECOVERY_KEY` when the bootloader is built. Without the third variable, the recovery key
/// is the root key. A missing release or root key is the development key.
pub static PUBLIC_KEYS: [[u8; KEY_LEN]; RANKS] = [RELEASE, ROOT, RECOVERY];

const RELEASE: [u8; KEY_LEN] = match option_env!("UPDATE_RELEASE_KEY") {
    Some(digits) => key(digits.as_bytes()),
    None => DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY,
};
const ROOT: [u8; KEY_LEN] = match option_env!("UPDATE_ROOT_KEY") {
    Some(digits) => key(digits.as_bytes()),
    None => DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY,
};
const RECOVERY: [u8; KEY_LEN] = match option_env!("UPDATE_RECOVERY_KEY") {
    Some(digits) => key(digits.as_bytes()),
    None => ROOT,
};

/// Public keys whose secret half is published: in this repository (the development key, and the keys of the tests) or in
/// RFC 8032, 7.1 and 7.3; and two points of small order, for which anybody can make signatures.
const PUBLISHED: [[u8; KEY_LEN]; 11] = [
    DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY,
    key(b"2152f8d19b791d24453242e15f2eab6cb7cffa7b6a5ed30097960e069881db12"),
    key(b"22fc297792f0b6ffc0bfcfdb7edb0c0aa14e025a365ec0e342e86e3829cb74b6"),
    key(b"d759793bbc13a2819a827c76adb6fba8a49aee007f49f2d0992d99b825ad2c48"),
    key(b"d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a"),
    key(b"3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c"),
    key(b"fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025"),
    key(b"278117fc144c72340f67d0f2316e8386ceffbf2b2428c9c51fef7c597f1d426e"),
    key(b"ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf"),
    [0; KEY_LEN],
    key(b"0100000000000000000000000000000000000000000000000000000000000000"),
];

/// Authorisation keys ([`crate::AUTHORISATION_KEY`]) that are published: the one of the tests, and zeros.
const PUBLISHED_SECRETS: [[u8; KEY_LEN]; 2] = [[0xC7; KEY_LEN], [0; KEY_LEN]];

/// Whether the secret half of this public key is published. Such a key protects nothing.
#[must_use]
pub const fn is_published(key: &[u8; KEY_LEN]) -> bool {
    is_among(key, &PUBLISHED)
}

/// Whether a key of this build is published: one of [`PUBLIC_KEYS`], or the authorisation key.
pub const HAS_PUBLISHED_KEY: bool = is_published(&RELEASE)
    || is_published(&ROOT)
    || is_published(&RECOVERY)
    || match &crate::AUTHORISATION_KEY {
        Some(secret) => is_among(secret, &PUBLISHED_SECRETS),
        None => false,
    };

const fn is_among(key: &[u8; KEY_LEN], mut list: &[[u8; KEY_LEN]]) -> bool {
    while let [first, rest @ ..] = list {
        if is_same(first, key) {
            return true;
        }
        list = rest;
    }
    false
}

/// The key with these digits, evaluated at compile time: anything but 64 hexadecimal digits stops the build.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated by the compiler")]
pub(crate) const fn key(digits: &[u8]) -> [u8; KEY_LEN] {
    assert!(digits.len() == 2 * KEY_LEN, "a key is not 64 hexadecimal digits");
    let (mut key, mut at) = ([0; KEY_LEN], 0);
    while at < KEY_LEN {
        key[at] = nibble(digits[2 * at]) << 4 | nibble(digits[2 * at + 1]);
        at += 1;
    }
    key
}

#[allow(clippy::arithmetic_side_effects, clippy::panic, reason = "evaluated by the compiler")]
const fn nibble(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        b'a'..=b'f' => digit - b'a' + 10,
        b'A'..=b'F' => digit - b'A' + 10,
        _ => panic!("a key is not 64 hexadecimal digits"),
    }
}

/// `==` of arrays at compile time.
const fn is_same(mut a: &[u8], mut b: &[u8]) -> bool {
    while let ([x, rest_of_a @ ..], [y, rest_of_b @ ..]) = (a, b) {
        if *x != *y {
            return false;
        }
        (a, b) = (rest_of_a, rest_of_b);
    }
    a.len() == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_read_from_its_digits() {
        const DIGITS: &[u8; 64] = b"FB874bc8d19eeb05b1016f27c27ccd9e985325ca80d8068bda9b5f44a39fe466";
        const KEY: [u8; KEY_LEN] = key(DIGITS);
        assert_eq!(KEY, DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY);
    }

    #[test]
    fn a_published_key_is_known_whatever_its_place_in_the_list() {
        for key in PUBLISHED {
            assert!(is_published(&key));
            let mut other = key;
            other[31] ^= 0x40;
            assert!(!is_published(&other));
        }
        assert!(PUBLISHED_SECRETS.iter().all(|secret| is_among(secret, &PUBLISHED_SECRETS)));
        const { assert!(HAS_PUBLISHED_KEY, "a build without keys has the development key") };
    }

    #[test]
    fn keys_are_distinguished() {
        let mut other = DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY;
        assert!(is_same(&other, &DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY));
        other[31] ^= 1;
        assert!(!is_same(&other, &DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY));
        assert!(!is_same(&[], &other));
    }
}
