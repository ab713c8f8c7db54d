//! The image header: 512 bytes in front of the vector table, in flash and in the downloaded file.

use core::fmt;

use crate::flash::all_are;
use crate::refusal::Refusal;

/// Bytes of the header (region `IMAGE_HEADER` of memory.x).
pub const HEADER_LEN: usize = HEADER as usize;
/// The same number, as a distance in flash.
pub(crate) const HEADER: u32 = 512;
/// Bytes of an Ed25519 signature.
pub const SIGNATURE_LEN: usize = 64;
/// Number of signed bytes of the header: all bytes before the signature.
pub const SIGNED_LEN: usize = HEADER_LEN - SIGNATURE_LEN - CRC_LEN;
const CRC_LEN: usize = 4;
/// Bytes of the fields at the begin of the header. The bytes between them and the signature are reserved.
const FIELDS_LEN: usize = 36;

/// First word of every image, whatever its format.
const MAGIC: u32 = u32::from_le_bytes(*b"CNFW");
/// Number of keys that a header can name.
pub(crate) const MOST_KEYS: u32 = 8;
/// The format that this crate reads and writes.
const FORMAT: u32 = 1;

/// Version of an application.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Number for incompatible changes.
    pub major: u16,
    /// Number for compatible additions.
    pub minor: u16,
    /// Number for corrections.
    pub patch: u16,
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// Properties of an image, set by its maker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// The board, as in 2004h:1.
    pub board: u32,
    /// The hardware revisions on which the image runs: bit n for revision n.
    pub hardware: u32,
    /// The version, for information only.
    pub version: Version,
    /// Security counter: a node on which an image has run accepts no image with a lower counter. It is raised only when
    /// older images must never run again.
    pub counter: u32,
    /// The number of the signing key, 0 to 7: its place among the keys of the bootloader.
    pub key: u8,
    /// Keys that are revoked when the image runs: bit n for key n. The image's own key must not be among them.
    pub revokes: u8,
}

/// The header of an image. A value of this type is always well-formed; whether the image is for this node, and whether
/// its signature is valid, is checked elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    description: Description,
    length: u32,
    code_crc: u32,
    signature: [u8; SIGNATURE_LEN],
    /// Over all other bytes of the header.
    crc: u32,
}

impl Header {
    /// The header of `code`, not signed yet. `None` if the code is empty or not a whole number of words (the unit of
    /// programming), or if the image would revoke its own key.
    #[must_use]
    pub fn describe(description: Description, code: &[u8]) -> Option<Header> {
        let length = u32::try_from(code.len()).ok()?;
        let code_crc = checksum::of(code);
        let header = Header { description, length, code_crc, signature: [0; SIGNATURE_LEN], crc: 0 };
        header.is_sensible().then_some(header.with_signature([0; SIGNATURE_LEN]))
    }

    /// The same header with this signature, made over [`Header::signed_part`] and the code.
    #[must_use]
    pub fn with_signature(self, signature: [u8; SIGNATURE_LEN]) -> Header {
        let mut digest = checksum::begin();
        digest.update(&self.signed_part());
        digest.update(&signature);
        Header { signature, crc: digest.finalize(), ..self }
    }

    /// Properties of the image.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Length of the code after the header in bytes: a whole number of words, never 0.
    #[must_use]
    pub fn length(&self) -> u32 {
        self.length
    }

    /// CRC-32 (ISO HDLC) of the code, the identification of the program (1F56h).
    #[must_use]
    pub fn code_crc(&self) -> u32 {
        self.code_crc
    }

    /// The signature in the header, valid or not.
    #[must_use]
    pub fn signature(&self) -> &[u8; SIGNATURE_LEN] {
        &self.signature
    }

    /// The bytes before the signature.
    #[must_use]
    pub fn signed_part(&self) -> [u8; SIGNED_LEN] {
        let Description { board, hardware, version, counter, key, revokes } = self.description;
        let Version { major, minor, patch } = version;
        let number = u32::from(major) | u32::from(minor) << 16;
        let keys = u32::from(patch) | u32::from(key) << 16 | u32::from(revokes) << 24;
        let words = [MAGIC, FORMAT, board, hardware, number, keys, self.length, self.code_crc, counter];
        let mut bytes = [0; SIGNED_LEN];
        bytes.as_chunks_mut().0.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
        bytes
    }

    /// The CRC-32 at the end of the header, over all other bytes of the header.
    #[must_use]
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// The bytes of the header in flash.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        let signed = self.signed_part();
        let content = signed.iter().chain(&self.signature);
        bytes.iter_mut().zip(content).for_each(|(to, byte)| *to = *byte);
        if let Some(end) = bytes.last_chunk_mut() {
            *end = self.crc.to_le_bytes();
        }
        bytes
    }

    /// The header in `bytes`. Only the exact bytes that [`Header::encode`] writes are accepted.
    ///
    /// # Errors
    /// [`Refusal::UnknownFormat`], [`Refusal::HeaderCrc`], or [`Refusal::HeaderContent`] if reserved bytes are not 0,
    /// the length is impossible, or the key is impossible or revokes itself.
    pub fn parse(bytes: &[u8; HEADER_LEN]) -> Result<Header, Refusal> {
        let mut words = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word));
        let mut next = || words.next().unwrap_or_default();
        if (next(), next()) != (MAGIC, FORMAT) {
            return Err(Refusal::UnknownFormat);
        }
        let (board, hardware, number, keys) = (next(), next(), next(), next());
        let (length, code_crc, counter) = (next(), next(), next());
        let version = Version { major: low(number), minor: low(number >> 16), patch: low(keys) };
        let [_, _, key, revokes] = keys.to_le_bytes();
        let description = Description { board, hardware, version, counter, key, revokes };
        let crc = crc_of(bytes).ok_or(Refusal::HeaderCrc)?;
        let header = Header { description, length, code_crc, signature: signature_in(bytes), crc };
        let reserved = bytes.get(FIELDS_LEN..SIGNED_LEN).unwrap_or_default();
        if all_are(reserved, 0) && header.is_sensible() { Ok(header) } else { Err(Refusal::HeaderContent) }
    }

    /// Whether the code is a whole number of words and not empty, the key number is possible, and the image does not
    /// revoke its own key.
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

/// The CRC at the end of the header, if it is right.
fn crc_of(bytes: &[u8; HEADER_LEN]) -> Option<u32> {
    let (content, crc) = bytes.split_last_chunk()?;
    let crc = u32::from_le_bytes(*crc);
    (checksum::of(content) == crc).then_some(crc)
}
