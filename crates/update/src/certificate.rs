//! The certificates in the header of an image: they replace the keys of the bootloader.
//!
//! | offset | bytes | field |
//! |---|---|---|
//! | 0 | 4 | generation |
//! | 4 | 4 | security counter |
//! | 8 | 32 | public key |
//! | 40 | 64 | Ed25519ph over bytes 0 to 39, with the context [`KEYS_CONTEXT`], made with the key of the rank above |
//!
//! The generation of a root key is a multiple of 16, that of a release key the generation of its root plus a
//! number below 16. A node accepts no image with a lower generation than that of an image that has run. So a
//! higher generation revokes every earlier release key, and that of another root key revokes the earlier root keys too.

use crate::header::SIGNATURE_LEN;
use crate::key::KEY_LEN;

/// Context of the signature of a certificate (RFC 8032, 5.1: the octet string C).
pub const KEYS_CONTEXT: &[u8] = b"CANopen node keys 1";
/// Bytes of a certificate in the header.
pub const CERTIFICATE_LEN: usize = CERTIFIED_LEN + SIGNATURE_LEN;
/// Number of generations, that of the bootloader's keys included.
pub const GENERATIONS: u32 = 64;
/// Bytes of a certificate that are signed.
pub(crate) const CERTIFIED_LEN: usize = 8 + KEY_LEN;
/// Number of generations of release keys under one root key.
pub const RELEASES: u32 = 16;

/// A public key, signed by the key of the rank above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Certificate {
    /// Generation of the key, above 0.
    pub generation: u32,
    /// The security counter from which the release key may raise it by [`crate::COUNTER_STEP`].
    pub counter: u32,
    /// The public key.
    pub key: [u8; KEY_LEN],
    /// The signature over [`Certificate::signed_part`].
    pub signature: [u8; SIGNATURE_LEN],
}

impl Certificate {
    /// The bytes that are signed.
    #[must_use]
    pub fn signed_part(&self) -> [u8; CERTIFIED_LEN] {
        let mut bytes = [0; CERTIFIED_LEN];
        let words = [self.generation, self.counter].into_iter().flat_map(u32::to_le_bytes);
        bytes.iter_mut().zip(words.chain(self.key)).for_each(|(to, byte)| *to = byte);
        bytes
    }

    /// The bytes in the header.
    #[must_use]
    pub fn encode(&self) -> [u8; CERTIFICATE_LEN] {
        let mut bytes = [0; CERTIFICATE_LEN];
        let content = self.signed_part().into_iter().chain(self.signature);
        bytes.iter_mut().zip(content).for_each(|(to, byte)| *to = byte);
        bytes
    }

    /// The certificate in these bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; CERTIFICATE_LEN]) -> Certificate {
        let (mut key, mut signature) = ([0; KEY_LEN], [0; SIGNATURE_LEN]);
        key.iter_mut().zip(bytes.iter().skip(8)).for_each(|(to, byte)| *to = *byte);
        signature.iter_mut().zip(bytes.iter().skip(CERTIFIED_LEN)).for_each(|(to, byte)| *to = *byte);
        Certificate { generation: word(bytes, 0), counter: word(bytes, 1), key, signature }
    }
}

/// The certificates of the keys that replace those of the bootloader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeyList {
    /// The certificate of the release key, signed with the root key.
    pub release: Option<Certificate>,
    /// The certificate of the root key, signed with the recovery key.
    pub root: Option<Certificate>,
}

impl KeyList {
    /// Bytes of a key list.
    pub const LEN: usize = 2 * CERTIFICATE_LEN;

    /// The bytes in the header.
    #[must_use]
    pub fn encode(&self) -> [u8; KeyList::LEN] {
        let mut bytes = [0; KeyList::LEN];
        let certificates = [self.release, self.root];
        let content =
            certificates.into_iter().flat_map(|it| it.map_or([0; CERTIFICATE_LEN], |it| it.encode()));
        bytes.iter_mut().zip(content).for_each(|(to, byte)| *to = byte);
        bytes
    }

    /// The key list in these bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; KeyList::LEN]) -> KeyList {
        let (release, root) = bytes.split_at(CERTIFICATE_LEN);
        let certificate = |bytes: &[u8]| {
            let certificate = Certificate::from_bytes(bytes.first_chunk()?);
            (certificate.generation != 0).then_some(certificate)
        };
        KeyList { release: certificate(release), root: certificate(root) }
    }

    /// The generation of the release key.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.release.map_or(0, |release| release.generation)
    }
}

/// The generation of the root key of a release key with this generation.
#[must_use]
pub fn root_generation(release: u32) -> u32 {
    release & !(RELEASES - 1)
}

/// A word of a certificate.
pub(crate) fn word(bytes: &[u8; CERTIFICATE_LEN], number: usize) -> u32 {
    bytes.as_chunks().0.get(number).map_or(0, |word| u32::from_le_bytes(*word))
}
