//! The key that images are signed with: its public half, in this one place.
//!
//! `cargo xtask sign key` makes a pair and prints the constant to put here; docs/update.md says how to keep the other half.

/// Bytes of an Ed25519 public key.
pub const KEY_LEN: usize = 32;

/// The public half of the DEVELOPMENT key. Its secret half is in the repository
/// (`tools/sign/keys/DEVELOPMENT-KEY-KNOWN-TO-EVERYBODY.pem`): a node that trusts it runs what anybody signs.
pub const DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY: [u8; KEY_LEN] = [
    0xFB, 0x87, 0x4B, 0xC8, 0xD1, 0x9E, 0xEB, 0x05, 0xB1, 0x01, 0x6F, 0x27, 0xC2, 0x7C, 0xCD, 0x9E, 0x98,
    0x53, 0x25, 0xCA, 0x80, 0xD8, 0x06, 0x8B, 0xDA, 0x9B, 0x5F, 0x44, 0xA3, 0x9F, 0xE4, 0x66,
];

/// The key that this bootloader trusts. To be replaced before anything is sold: the feature `production` does not
/// compile with the development key.
pub const PUBLIC_KEY: [u8; KEY_LEN] = DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY;

#[cfg(feature = "production")]
const _: () = assert!(
    !is_same(&PUBLIC_KEY, &DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY),
    "a production build needs a key of its own in crates/update/src/key.rs (docs/update.md)"
);

/// `==` of arrays, for the compiler.
#[cfg(any(feature = "production", test))]
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
    fn keys_are_told_apart() {
        let mut other = DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY;
        assert!(is_same(&other, &DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY));
        other[31] ^= 1;
        assert!(!is_same(&other, &DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY));
        assert!(!is_same(&[], &other));
    }
}
