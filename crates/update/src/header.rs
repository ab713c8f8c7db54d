//! The image header: 512 bytes in front of the vector table, in flash as in the file that is downloaded.

use core::fmt;

use crate::refusal::Refusal;

/// Bytes of the header (region `IMAGE_HEADER` of memory.x).
pub const HEADER_LEN: usize = HEADER as usize;
/// The same, as a distance in flash.
pub(crate) const HEADER: u32 = 512;
/// Bytes of an Ed25519 signature.
pub const SIGNATURE_LEN: usize = 64;
/// Bytes of the header that are signed: all before the signature.
pub const SIGNED_LEN: usize = HEADER_LEN - SIGNATURE_LEN - CRC_LEN;
const CRC_LEN: usize = 4;

/// First word of every image, whatever its format.
const MAGIC: u32 = u32::from_le_bytes(*b"CNFW");
/// Keys that a header can name.
pub(crate) const MOST_KEYS: u32 = 8;
/// The format that this crate reads and writes.
const FORMAT: u32 = 1;

/// Version of an application.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Changes that break.
    pub major: u16,
    /// Changes that add.
    pub minor: u16,
    /// Changes that correct.
    pub patch: u16,
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// What the maker of an image says of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// The product that it is for, as in 1018h:2.
    pub product: u32,
    /// The hardware revisions that it runs on: bit n for revision n.
    pub hardware: u32,
    /// Its version, for people. Nothing is decided by it.
    pub version: Version,
    /// Security counter: where an image has run, none with a lower counter is accepted. It grows only when an older image must
    /// never run again.
    pub counter: u32,
    /// The number of the key that it is signed with, 0 to 7: its place among the keys of the bootloader.
    pub key: u8,
    /// Keys that are revoked when it runs: bit n for key n. Its own key cannot be one of them.
    pub revokes: u8,
}

/// The header of one image. A value of this type is always well-formed; whether it is for this node, and whether the
/// signature is good, is decided elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    description: Description,
    length: u32,
    code_crc: u32,
    signature: [u8; SIGNATURE_LEN],
}

impl Header {
    /// The header of `code`, not signed yet. `None` when the code is empty or no whole number of words, which is
    /// what flash is programmed in, or when it would revoke its own key.
    #[must_use]
    pub fn describe(description: Description, code: &[u8]) -> Option<Header> {
        let length = u32::try_from(code.len()).ok()?;
        let code_crc = checksum::of(code);
        let header = Header { description, length, code_crc, signature: [0; SIGNATURE_LEN] };
        header.is_sensible().then_some(header)
    }

    /// The same header with this signature, made over [`Header::signed_part`] and the code.
    #[must_use]
    pub fn with_signature(self, signature: [u8; SIGNATURE_LEN]) -> Header {
        Header { signature, ..self }
    }

    /// What the maker says of the image.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Bytes of code after the header: a whole number of words, never 0.
    #[must_use]
    pub fn length(&self) -> u32 {
        self.length
    }

    /// CRC-32 (ISO HDLC) of the code, the identification of the program (1F56h).
    #[must_use]
    pub fn code_crc(&self) -> u32 {
        self.code_crc
    }

    /// The signature as it is in the header, good or not.
    #[must_use]
    pub fn signature(&self) -> &[u8; SIGNATURE_LEN] {
        &self.signature
    }

    /// The bytes before the signature.
    #[must_use]
    pub fn signed_part(&self) -> [u8; SIGNED_LEN] {
        let Description { product, hardware, version, counter, key, revokes } = self.description;
        let Version { major, minor, patch } = version;
        let number = u32::from(major) | u32::from(minor) << 16;
        let keys = u32::from(patch) | u32::from(key) << 16 | u32::from(revokes) << 24;
        let words = [MAGIC, FORMAT, product, hardware, number, keys, self.length, self.code_crc, counter];
        let mut bytes = [0; SIGNED_LEN];
        bytes.as_chunks_mut().0.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
        bytes
    }

    /// The CRC-32 at the end of the header, which covers all the rest of it.
    #[must_use]
    pub fn crc(&self) -> u32 {
        let mut digest = checksum::begin();
        digest.update(&self.signed_part());
        digest.update(&self.signature);
        digest.finalize()
    }

    /// The header as it is in flash.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        let signed = self.signed_part();
        let content = signed.iter().chain(&self.signature);
        bytes.iter_mut().zip(content).for_each(|(to, byte)| *to = *byte);
        if let Some(end) = bytes.last_chunk_mut() {
            *end = self.crc().to_le_bytes();
        }
        bytes
    }

    /// The header in `bytes`. Nothing is left open: exactly the bytes that [`Header::encode`] writes are accepted.
    ///
    /// # Errors
    /// [`Refusal::UnknownFormat`], [`Refusal::HeaderCrc`], or [`Refusal::HeaderContent`] when reserved bytes are not 0, the length is
    /// none that an image can have, or the key is none or revokes itself.
    pub fn parse(bytes: &[u8; HEADER_LEN]) -> Result<Header, Refusal> {
        let mut words = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word));
        let mut next = || words.next().unwrap_or_default();
        if (next(), next()) != (MAGIC, FORMAT) {
            return Err(Refusal::UnknownFormat);
        }
        let (product, hardware, number, keys) = (next(), next(), next(), next());
        let (length, code_crc, counter) = (next(), next(), next());
        let version = Version { major: low(number), minor: low(number >> 16), patch: low(keys) };
        let [_, _, key, revokes] = keys.to_le_bytes();
        let description = Description { product, hardware, version, counter, key, revokes };
        let header = Header { description, length, code_crc, signature: signature_in(bytes) };
        header.agrees_with(bytes)
    }

    fn agrees_with(self, bytes: &[u8; HEADER_LEN]) -> Result<Header, Refusal> {
        if !has_good_crc(bytes) {
            Err(Refusal::HeaderCrc)
        } else if self.encode() != *bytes || !self.is_sensible() {
            Err(Refusal::HeaderContent)
        } else {
            Ok(self)
        }
    }

    /// Whether there is code, in whole words, and the key of the image is one that there can be and stays good.
    fn is_sensible(&self) -> bool {
        let Description { key, revokes, .. } = self.description;
        let is_length = self.length != 0 && self.length.is_multiple_of(4);
        is_length && u32::from(key) < MOST_KEYS && revokes.checked_shr(key.into()).unwrap_or(0) & 1 == 0
    }
}

fn low(word: u32) -> u16 {
    (word & 0xFFFF) as u16
}

fn signature_in(bytes: &[u8; HEADER_LEN]) -> [u8; SIGNATURE_LEN] {
    let mut signature = [0; SIGNATURE_LEN];
    signature.iter_mut().zip(bytes.iter().skip(SIGNED_LEN)).for_each(|(to, byte)| *to = *byte);
    signature
}

fn has_good_crc(bytes: &[u8; HEADER_LEN]) -> bool {
    bytes.split_last_chunk().is_some_and(|(content, crc)| checksum::of(content).to_le_bytes() == *crc)
}
