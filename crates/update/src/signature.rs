//! The signature of an image: Ed25519ph (RFC 8032, 5.1) over the signed part of the header and the code.
//!
//! It is the variant with the hash in front because that can be made in small steps: plain Ed25519 takes the whole message
//! in one call, 0.2 s for the longest image. The context keeps a signature that the same key made for something else from
//! being one of an image.
//!
//! The library is `salty` (Apache-2.0 or MIT): 9.6 KB of flash on the target where ed25519-dalek takes 40.9 KB, more than
//! the bootloader has. Its field arithmetic is assembly on a Cortex-M4 and plain Rust elsewhere, as in the tests.

use salty::{PublicKey, Sha512, Signature};

use crate::header::{Header, SIGNATURE_LEN};
use crate::key::KEY_LEN;

/// Context of the signature (RFC 8032, 5.1: the octet string C).
pub const CONTEXT: &[u8] = b"CANopen node image 1";

/// What was signed, as far as it was seen.
pub(crate) struct Message(Sha512);

impl Message {
    /// Begins with the header.
    pub(crate) fn of(header: &Header) -> Message {
        Message(Sha512::new().updated(&header.signed_part()))
    }

    /// Goes on with code.
    pub(crate) fn add(&mut self, code: &[u8]) {
        self.0.update(code);
    }

    /// Whether the signature is one of this message by the owner of the key: 4.3 million instructions on the target, 30 to
    /// 60 ms at 144 MHz, which cannot be divided.
    pub(crate) fn has_signature(self, signature: &[u8; SIGNATURE_LEN], key: &[u8; KEY_LEN]) -> bool {
        if !is_reduced(signature) {
            return false;
        }
        let hash = self.0.finalize();
        let signature = Signature::from(signature);
        PublicKey::try_from(key)
            .is_ok_and(|key| key.verify_prehashed(&hash, &signature, Some(CONTEXT)).is_ok())
    }
}

/// The order of the base point, low byte first (RFC 8032, 5.1: L).
const ORDER: [u8; 32] = [
    0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE, 0x14, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10,
];

/// Whether the second half, the number S, is below the order, as RFC 8032, 5.1.7 wants it and salty does not ask: else
/// everybody could make another signature of what was signed.
fn is_reduced(signature: &[u8; SIGNATURE_LEN]) -> bool {
    signature.iter().rev().take(ORDER.len()).lt(ORDER.iter().rev())
}
