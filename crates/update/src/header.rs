//! The image header: 512 bytes in front of the vector table, in flash and in the downloaded file.

use core::fmt;

use crate::area::Area;
use crate::certificate::CERTIFIED_LEN;
use crate::flash::{Flash, all_are};
use crate::key::{CERTIFICATE_LEN, Certificate, GENERATIONS, KEY_LEN, KeyList, Rank, root_generation};
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
/// Bytes of the fields at the begin of the header. The two certificates follow, and reserved bytes up to the signature.
const FIELDS_LEN: usize = 36;
const ROOT_AT: usize = FIELDS_LEN + CERTIFICATE_LEN;
const RESERVED_AT: usize = ROOT_AT + CERTIFICATE_LEN;

/// First word of every image, whatever its format.
const MAGIC: u32 = u32::from_le_bytes(*b"CNFW");
/// The format that this crate reads and writes.
const FORMAT: u32 = 2;

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
    /// The certificates of the keys that replace those of the bootloader.
    pub keys: KeyList,
}

/// The header of an image. A value of this type is always well-formed; whether the image is for this node, and whether
/// its signature is valid, is checked elsewhere.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(align(4))] // Copied in words.
pub struct Header([u8; HEADER_LEN]);

/// Numbers of the words of the header.
const BOARD: usize = 2;
const HARDWARE: usize = 3;
const VERSION: usize = 4;
const PATCH: usize = 5;
const LENGTH: usize = 6;
const CODE_CRC: usize = 7;
const COUNTER: usize = 8;
const CRC: usize = HEADER_LEN / 4 - 1;

impl Header {
    /// Bytes to read a header into.
    pub(crate) const EMPTY: Header = Header([0; HEADER_LEN]);

    /// The header of `code`, not signed yet. `None` if the code is empty or not a whole number of words (the unit of
    /// programming), or if the generations of the key list do not fit each other.
    #[must_use]
    pub fn describe(description: Description, code: &[u8]) -> Option<Header> {
        let length = u32::try_from(code.len()).ok()?;
        let Description { board, hardware, version, counter, keys } = description;
        let Version { major, minor, patch } = version;
        let number = u32::from(major) | u32::from(minor) << 16;
        let words = [
            MAGIC,
            FORMAT,
            board,
            hardware,
            number,
            patch.into(),
            length,
            storage::checksum::of(code),
            counter,
        ];
        let words = words.into_iter().flat_map(u32::to_le_bytes);
        let mut header = Header::EMPTY;
        header.0.iter_mut().zip(words.chain(keys.encode())).for_each(|(to, byte)| *to = byte);
        header.is_sensible().then_some(header.with_signature([0; SIGNATURE_LEN]))
    }

    /// The same header with this signature, made over [`Header::signed_part`] and the code.
    #[must_use]
    pub fn with_signature(mut self, signature: [u8; SIGNATURE_LEN]) -> Header {
        self.0.iter_mut().skip(SIGNED_LEN).zip(signature).for_each(|(to, byte)| *to = byte);
        if let Some((content, crc)) = self.0.split_last_chunk_mut() {
            *crc = storage::checksum::of(content).to_le_bytes();
        }
        self
    }

    /// Properties of the image.
    #[must_use]
    pub fn description(&self) -> Description {
        Description {
            board: self.board(),
            hardware: self.hardware(),
            version: self.version(),
            counter: self.counter(),
            keys: KeyList {
                release: self.certificate(Rank::Release).map(Certificate::from_bytes),
                root: self.certificate(Rank::Root).map(Certificate::from_bytes),
            },
        }
    }

    /// The version of the image.
    pub(crate) fn version(&self) -> Version {
        let number = self.word(VERSION);
        Version { major: low(number), minor: low(number >> 16), patch: low(self.word(PATCH)) }
    }

    /// The board of the image.
    pub(crate) fn board(&self) -> u32 {
        self.word(BOARD)
    }

    /// The hardware revisions of the image.
    pub(crate) fn hardware(&self) -> u32 {
        self.word(HARDWARE)
    }

    /// The security counter of the image.
    #[must_use]
    pub fn counter(&self) -> u32 {
        self.word(COUNTER)
    }

    /// Length of the code after the header in bytes: a whole number of words, never 0.
    #[must_use]
    pub fn length(&self) -> u32 {
        self.word(LENGTH)
    }

    /// CRC-32 (ISO HDLC) of the code, the identification of the program (1F56h).
    #[must_use]
    pub fn code_crc(&self) -> u32 {
        self.word(CODE_CRC)
    }

    /// The generation of the release key: 0 for the keys of the bootloader.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.word(FIELDS_LEN / 4)
    }

    /// The generation of the root key: 0 for that of the bootloader.
    pub(crate) fn root_generation(&self) -> u32 {
        self.word(ROOT_AT / 4)
    }

    /// The bytes of the certificate of the key of this rank; `None` if the bootloader has the key.
    pub(crate) fn certificate(&self, rank: Rank) -> Option<&[u8; CERTIFICATE_LEN]> {
        let at = match rank {
            Rank::Release => FIELDS_LEN,
            Rank::Root => ROOT_AT,
            Rank::Recovery => return None,
        };
        self.0.get(at..)?.first_chunk().filter(|_| self.word(at / 4) != 0)
    }

    /// The key of this rank in its certificate, if there is one.
    pub(crate) fn certified_key(&self, rank: Rank) -> Option<&[u8; KEY_LEN]> {
        self.certificate(rank)?.get(CERTIFIED_LEN - KEY_LEN..)?.first_chunk()
    }

    /// The bytes signed as a certificate by the key of this rank, and the signature; `None` for the release key, which signs
    /// the image.
    pub(crate) fn signed_by(&self, rank: Rank) -> Option<(&[u8], &[u8; SIGNATURE_LEN])> {
        let below = match rank {
            Rank::Release => return None,
            Rank::Root => Rank::Release,
            Rank::Recovery => Rank::Root,
        };
        self.certificate(below)?.split_last_chunk()
    }

    /// The counter in the certificate of the release key.
    pub(crate) fn certified_counter(&self) -> u32 {
        self.word(FIELDS_LEN / 4 + 1)
    }

    /// The signature in the header, valid or not.
    #[must_use]
    pub fn signature(&self) -> &[u8; SIGNATURE_LEN] {
        self.0.get(SIGNED_LEN..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; SIGNATURE_LEN])
    }

    /// The bytes before the signature.
    #[must_use]
    pub fn signed_part(&self) -> &[u8; SIGNED_LEN] {
        self.0.first_chunk().unwrap_or(&[0; SIGNED_LEN])
    }

    /// The CRC-32 at the end of the header, over all other bytes of the header.
    #[must_use]
    pub fn crc(&self) -> u32 {
        self.word(CRC)
    }

    /// The bytes of the header in flash.
    #[must_use]
    pub fn encode(&self) -> [u8; HEADER_LEN] {
        self.0
    }

    /// The header in `bytes`. Only the exact bytes that [`Header::encode`] writes are accepted.
    ///
    /// # Errors
    /// [`Refusal::UnknownFormat`], [`Refusal::HeaderCrc`], or [`Refusal::HeaderContent`] if reserved bytes are not 0,
    /// the length is impossible, or the generations of the certificates do not fit each other.
    pub fn parse(bytes: &[u8; HEADER_LEN]) -> Result<Header, Refusal> {
        let header = Header(*bytes);
        header.check().map(|()| header)
    }

    /// The header in `area`. It is written in place, because there is little room in flash for copies.
    pub(crate) fn read<F: Flash>(&mut self, flash: &mut F, area: Area) -> Result<(), Refusal> {
        flash.read(area.start(), &mut self.0).map_err(|_| Refusal::Unspecified)?;
        self.check()
    }

    fn check(&self) -> Result<(), Refusal> {
        if (self.word(0), self.word(1)) != (MAGIC, FORMAT) {
            return Err(Refusal::UnknownFormat);
        }
        let content = self.0.split_last_chunk::<CRC_LEN>().map_or(&[][..], |(content, _)| content);
        if storage::checksum::of(content) != self.crc() {
            Err(Refusal::HeaderCrc)
        } else if self.is_sensible() {
            Ok(())
        } else {
            Err(Refusal::HeaderContent)
        }
    }

    /// Whether the code is a whole number of words and not empty, the generations of the certificates fit each other, and
    /// the reserved bytes are 0.
    fn is_sensible(&self) -> bool {
        let (release, root) = (self.generation(), self.root_generation());
        let reserved_at = match (release, root) {
            (0, _) => FIELDS_LEN,
            (_, 0) => ROOT_AT,
            _ => RESERVED_AT,
        };
        let reserved = self.0.get(reserved_at..SIGNED_LEN).unwrap_or_default();
        self.length() != 0
            && self.length().is_multiple_of(4)
            && self.word(PATCH) >> 16 == 0
            && release < GENERATIONS
            && root_generation(release) == root
            && all_are(reserved, 0)
    }

    /// The word with this number.
    #[inline(never)] // Many callers, and little room in flash.
    fn word(&self, number: usize) -> u32 {
        self.0.as_chunks().0.get(number).map_or(0, |word| u32::from_le_bytes(*word))
    }
}

impl fmt::Debug for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut header = f.debug_struct("Header");
        header.field("description", &self.description());
        header.field("length", &self.length()).field("code_crc", &self.code_crc()).finish_non_exhaustive()
    }
}

fn low(word: u32) -> u16 {
    (word & 0xFFFF) as u16
}
