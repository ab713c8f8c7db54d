//! The signature of an image: Ed25519ph (RFC 8032, 5.1) over the signed part of the header and the code.
//!
//! This is the variant with a prehash, because the hash can be computed in small steps. The rest can too: the equation
//! of RFC 8032, 5.1.7 is computed eight bits at a time, so that the bus is served in between. The context prevents that
//! a signature made with the same key for another purpose is valid for an image.
//!
//! The hash is that of `sha2`, whose indices the compiler can prove. The arithmetic of points is that of `salty`
//! (Apache-2.0 or MIT; assembly on a Cortex-M4, plain Rust elsewhere). The function `verify_prehashed` of `salty` gives
//! the same results, as the tests show, but in one piece of 4.3 million instructions and with 3 KB more flash: it
//! multiplies with ladders that hide the numbers, although none is secret here, and first reduces the hash modulo the
//! order of the curve, which the RFC does not require.

use core::ops::{Add, Neg};

use salty::{CompressedY, EdwardsPoint};
use sha2::{Digest, Sha512};

use crate::header::{Header, SIGNATURE_LEN};
use crate::key::KEY_LEN;
use crate::seal::seal;

/// Context of the signature (RFC 8032, 5.1: the octet string C).
pub const CONTEXT: &[u8] = b"CANopen node image 1";

/// The signed bytes hashed so far.
pub(crate) struct Message(Sha512);

impl Message {
    /// Begins with the signed part of the header.
    pub(crate) fn of(header: &Header) -> Message {
        Message(Sha512::new_with_prefix(header.signed_part()))
    }

    /// Adds code.
    pub(crate) fn add(&mut self, code: &[u8]) {
        self.0.update(code);
    }

    /// The hash of all added bytes.
    pub(crate) fn end(self) -> [u8; HASH_LEN] {
        self.0.finalize().into()
    }
}

/// The hash of these parts, one after the other.
#[inline(never)] // Many callers, and little room in flash.
pub(crate) fn hash(parts: &[&[u8]]) -> [u8; HASH_LEN] {
    let mut hash = Sha512::new();
    for part in parts {
        hash.update(part);
    }
    hash.finalize().into()
}

/// Bytes of a hash.
pub(crate) const HASH_LEN: usize = 64;
/// Bytes of a number or a point.
const LEN: usize = 32;
/// The octets before the hashed data (RFC 8032, 2: dom2), then phflag, then the length of the context.
const DOMAIN: &[u8] = b"SigEd25519 no Ed25519 collisions\x01";

/// The verification of a signature, which consists of a point R and a number S: whether \[S\]B = R + \[k\]A, where B is
/// the base point, A the key, and k a hash of everything. \[S\]B - \[k\]A is computed and compared with R.
pub(crate) struct Verification {
    /// R, then S.
    signature: [u8; SIGNATURE_LEN],
    k: [u8; HASH_LEN],
    key: [u8; KEY_LEN],
    /// -A.
    minus_key: EdwardsPoint,
    /// The sum over the bits processed so far, the highest bits first.
    sum: EdwardsPoint,
    /// Number of bytes of the two numbers that are not processed yet.
    rest: usize,
    /// \[S\]B - \[k\]A after the last step, compressed: the R that would make the signature valid. Zeros before.
    found: [u8; LEN],
}

impl Verification {
    /// Starts to verify the signature of a message with this hash. `None` if the signature cannot be valid: S is not
    /// reduced, or the key is not a point.
    pub(crate) fn new(
        hash: &[u8; HASH_LEN],
        context: &[u8],
        signature: &[u8; SIGNATURE_LEN],
        key: &[u8; KEY_LEN],
    ) -> Option<Verification> {
        let (r, s) = halves(signature);
        if !is_reduced(s) {
            return None;
        }
        let minus_key = CompressedY(*key).decompressed().ok()?.neg();
        let length = u8::try_from(context.len()).ok()?;
        let k = self::hash(&[DOMAIN, &[length], context, r, key, hash]);
        let sum = EdwardsPoint::neutral_element();
        Some(Verification {
            signature: *signature,
            k,
            key: *key,
            minus_key,
            sum,
            rest: HASH_LEN,
            found: [0; LEN],
        })
    }

    /// Does one step of 65: a byte of the numbers, or finally the comparison. Returns whether the signature is valid
    /// after the last step.
    pub(crate) fn step(&mut self) -> Option<bool> {
        let known = known_point(self);
        if let Some(at) = self.rest.checked_sub(1) {
            self.rest = at;
            if known.is_none() {
                self.add_byte(at);
            }
            None
        } else {
            self.found = known.unwrap_or_else(|| self.sum.compressed().0);
            #[cfg(feature = "mock")]
            crate::mock::learn_point(self.equation(), self.found);
            Some(self.found == *halves(&self.signature).0)
        }
    }

    /// The numbers of \[S\]B - \[k\]A.
    #[cfg(feature = "mock")]
    fn equation(&self) -> std::vec::Vec<u8> {
        [&halves(&self.signature).1[..], &self.k, &self.key].concat()
    }

    /// The result as a word, after the last step: see [`seal`].
    pub(crate) fn seal(&self, crc: u32) -> u32 {
        seal(crc, &self.found, halves(&self.signature).0)
    }

    /// The key used for the verification.
    pub(crate) fn key(&self) -> &[u8; KEY_LEN] {
        &self.key
    }

    /// Doubles and adds for one byte of the numbers. S has no bits beyond its 32 bytes.
    fn add_byte(&mut self, at: usize) {
        let [k, s] =
            [self.k.get(at), halves(&self.signature).1.get(at)].map(|byte| byte.copied().unwrap_or(0));
        let base = EdwardsPoint::basepoint();
        for bit in (0..8).rev() {
            self.sum = self.sum.add(&self.sum);
            for (number, point) in [(k, &self.minus_key), (s, &base)] {
                if number >> bit & 1 != 0 {
                    self.sum = self.sum.add(point);
                }
            }
        }
    }
}

/// The point of a verification that a test has computed before.
#[cfg(feature = "mock")]
fn known_point(of: &Verification) -> Option<[u8; LEN]> {
    crate::mock::known_point(&of.equation())
}

#[cfg(not(feature = "mock"))]
fn known_point(_: &Verification) -> Option<[u8; LEN]> {
    None
}

/// R and S of a signature.
fn halves(signature: &[u8; SIGNATURE_LEN]) -> (&[u8; LEN], &[u8; LEN]) {
    let (halves, _) = signature.as_chunks();
    match halves {
        [r, s] => (r, s),
        _ => (&[0; LEN], &[0; LEN]),
    }
}

/// The order of the base point, low byte first (RFC 8032, 5.1: L).
const ORDER: [u8; LEN] = [
    0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE, 0x14, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10,
];

/// Whether S is below the order (RFC 8032, 5.1.7): otherwise anybody could make another valid signature of the same
/// message.
fn is_reduced(s: &[u8; LEN]) -> bool {
    s.iter().rev().lt(ORDER.iter().rev())
}

#[cfg(test)]
mod tests {
    use salty::{Keypair, PublicKey, Signature};

    use super::*;

    fn is_good(
        hash: &[u8; 64],
        context: &[u8],
        signature: &[u8; SIGNATURE_LEN],
        key: &[u8; KEY_LEN],
    ) -> bool {
        let verification = Verification::new(hash, context, signature, key);
        verification.is_some_and(|mut it| (0..=HASH_LEN).find_map(|_| it.step()).unwrap())
    }

    /// The result of the library, computed in one piece.
    fn is_good_to_salty(hash: &[u8; 64], signature: &[u8; SIGNATURE_LEN], key: &[u8; KEY_LEN]) -> bool {
        let signature = Signature::from(signature);
        PublicKey::try_from(key)
            .is_ok_and(|key| key.verify_prehashed(hash, &signature, Some(CONTEXT)).is_ok())
    }

    fn bytes<const N: usize>(hex: &str) -> [u8; N] {
        core::array::from_fn(|at| u8::from_str_radix(&hex[2 * at..][..2], 16).unwrap())
    }

    /// Test vector of RFC 8032, 7.3.
    #[test]
    fn the_signature_of_abc_is_good() {
        let key = bytes("ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf");
        let signature = bytes(
            "98a70222f0b8121aa9d30f813d683f809e462b469c7ff87639499bb94e6dae41\
             31f85042463c2a355a2003d062adf5aaa10b8c61e636062aaad11c2a26083406",
        );
        let hash = Sha512::digest(b"abc").into();
        assert!(is_good(&hash, &[], &signature, &key));
        assert!(!is_good(&hash, CONTEXT, &signature, &key));
        assert!(!is_good(&Sha512::digest(b"abd").into(), &[], &signature, &key));
    }

    #[test]
    fn every_changed_bit_of_signature_key_and_hash_is_seen() {
        let keys = Keypair::from(&[3; 32]);
        let (hash, key) = ([0x5A; 64], keys.public.to_bytes());
        let signature = keys.sign_prehashed(&hash, Some(CONTEXT)).to_bytes();
        assert!(is_good(&hash, CONTEXT, &signature, &key));
        for bit in 0..512 {
            let (at, flip) = (bit / 8, 1 << (bit % 8));
            let (mut hash, mut signature, mut key) = (hash, signature, key);
            signature[at] ^= flip;
            assert!(!is_good(&hash, CONTEXT, &signature, &key), "bit {bit} of the signature");
            signature[at] ^= flip;
            hash[at] ^= flip;
            assert!(!is_good(&hash, CONTEXT, &signature, &key), "bit {bit} of the hash");
            hash[at] ^= flip;
            key[at % 32] ^= flip;
            assert!(!is_good(&hash, CONTEXT, &signature, &key), "bit {bit} of the key");
        }
    }

    #[test]
    fn it_judges_as_the_library_does() {
        for seed in 0..100 {
            let keys = Keypair::from(&[seed; 32]);
            let (hash, key) = (Sha512::digest([seed]).into(), keys.public.to_bytes());
            let mut signature = keys.sign_prehashed(&hash, Some(CONTEXT)).to_bytes();
            assert!(is_good(&hash, CONTEXT, &signature, &key) && is_good_to_salty(&hash, &signature, &key));
            signature[usize::from(seed) % SIGNATURE_LEN] ^= 1;
            assert_eq!(is_good(&hash, CONTEXT, &signature, &key), is_good_to_salty(&hash, &signature, &key));
        }
    }

    /// The library accepts it, because adding the order to S changes nothing in the equation.
    #[test]
    fn a_signature_whose_s_is_not_reduced_is_refused() {
        let keys = Keypair::from(&[3; 32]);
        let (hash, key) = ([0x5A; 64], keys.public.to_bytes());
        let mut signature = keys.sign_prehashed(&hash, Some(CONTEXT)).to_bytes();
        let mut carry = 0;
        for (byte, order) in signature[LEN..].iter_mut().zip(ORDER) {
            let sum = u16::from(*byte) + u16::from(order) + carry;
            (*byte, carry) = ((sum & 0xFF) as u8, sum >> 8);
        }
        assert!(is_good_to_salty(&hash, &signature, &key));
        assert!(!is_good(&hash, CONTEXT, &signature, &key));
        assert!(!is_reduced(&ORDER) && is_reduced(&[0; LEN]));
    }
}
