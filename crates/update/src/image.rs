//! An image in flash: its header, and the stepwise checks of its code.

use core::ops::Range;

use checksum::Digest;

use crate::area::Area;
use crate::flash::{CHUNK, Flash, PIECES, read_piece};
use crate::header::{HEADER, HEADER_LEN, Header};
use crate::refusal::Refusal;
use crate::seal::seal;
use crate::signature::{CONTEXT, HASH_LEN, Message, Verification};
use crate::target::{Target, image_len};

/// The header at the start of `area`.
pub(crate) fn header<F: Flash>(flash: &mut F, area: Area) -> Result<Header, Refusal> {
    let mut bytes = [0; HEADER_LEN];
    flash.read(area.start(), &mut bytes).map_err(|_| Refusal::Unspecified)?;
    Header::parse(&bytes)
}

/// The header at the start of `area`, if the image may run on this node, provided that the rest of it is valid.
pub(crate) fn admitted<F: Flash>(flash: &mut F, target: &Target, area: Area) -> Result<Header, Refusal> {
    let header = header(flash, area)?;
    target.admit(flash, &header).map(|()| header)
}

/// Range of the code of an image in `area`.
pub(crate) fn code(header: &Header, area: Area) -> Range<u32> {
    let start = area.start();
    start.saturating_add(HEADER)..start.saturating_add(image_len(header))
}

/// The header of the staged image, if it may replace the application: it may run on this node, and its security counter
/// is not lower than the application's, which may not have been recorded yet.
pub(crate) fn candidate<F: Flash>(flash: &mut F, target: &Target) -> Result<Header, Refusal> {
    let staged = admitted(flash, target, target.layout.staging())?;
    let least = header(flash, target.layout.application()).map_or(0, |header| header.description().counter);
    if staged.description().counter < least { Err(Refusal::Counter { least }) } else { Ok(staged) }
}

/// A CRC check in progress.
#[derive(Clone)]
pub(crate) struct CrcCheck {
    expected: u32,
    rest: Range<u32>,
    digest: Digest,
}

impl CrcCheck {
    pub(crate) fn new(header: &Header, area: Area) -> CrcCheck {
        CrcCheck { expected: header.code_crc(), rest: code(header, area), digest: checksum::begin() }
    }

    /// Does one step; returns whether the check is complete. The CRC is judged only at the end. The bytes are also added
    /// to the message.
    pub(crate) fn step<F: Flash>(
        &mut self,
        flash: &mut F,
        message: &mut Option<Message>,
    ) -> Result<bool, Refusal> {
        for _ in 0..PIECES {
            let mut buffer = [0; CHUNK];
            let bytes = read_piece(flash, &mut self.rest, &mut buffer)?;
            self.digest.update(bytes);
            if let Some(message) = message {
                message.add(bytes);
            }
        }
        if !self.rest.is_empty() {
            return Ok(false);
        }
        if self.digest.clone().finalize() == self.expected { Ok(true) } else { Err(Refusal::CodeCrc) }
    }
}

/// A full check of an image in progress: first its content, then its signature. The signature is verified twice,
/// starting from the hash of the image, so that a single skipped instruction or wrong bit spoils only one of the two
/// verifications.
pub(crate) struct FullCheck {
    header: Header,
    crc: CrcCheck,
    /// `None` if the signature is not checked.
    message: Option<Message>,
    hash: [u8; HASH_LEN],
    signature: Option<Verification>,
    /// The word of the first verification.
    first: Option<u32>,
}

impl FullCheck {
    /// A check of the staged image.
    pub(crate) fn new<F: Flash>(flash: &mut F, target: &Target) -> Result<FullCheck, Refusal> {
        Ok(FullCheck::of(&candidate(flash, target)?, target.layout.staging(), true))
    }

    /// A check of the image with this header in an area, with or without its signature.
    pub(crate) fn of(header: &Header, area: Area, is_signed: bool) -> FullCheck {
        let crc = CrcCheck::new(header, area);
        let message = is_signed.then(|| Message::of(header));
        FullCheck { header: *header, crc, message, hash: [0; HASH_LEN], signature: None, first: None }
    }

    /// The header of the image.
    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// Does one step; returns whether the whole check has passed.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<bool, Refusal> {
        let Some(signature) = &mut self.signature else { return self.read(flash, target) };
        match (signature.step(), self.first) {
            (None, _) => Ok(false),
            (Some(false), _) => Err(Refusal::Signature),
            (Some(true), Some(_)) => Ok(true),
            (Some(true), None) => {
                self.first = Some(signature.seal(self.header.crc()));
                self.verify(target)
            }
        }
    }

    /// The CRC of the header once both verifications have found the signature valid; another word before that, and with
    /// any other signature. The key of the verification is compared with the key looked up here, because both
    /// verifications may have used the same wrong key.
    pub(crate) fn seal(&self, target: &Target) -> u32 {
        let (Some(signature), Some(first)) = (&self.signature, self.first) else { return 0 };
        let Some(key) = target.key_of(&self.header) else { return 0 };
        seal(signature.seal(first), signature.key(), key)
    }

    fn read<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<bool, Refusal> {
        if !self.crc.step(flash, &mut self.message)? {
            return Ok(false);
        }
        let Some(message) = &mut self.message else { return Ok(true) };
        self.hash = message.end();
        self.verify(target)
    }

    /// Starts a verification of the signature.
    fn verify(&mut self, target: &Target) -> Result<bool, Refusal> {
        let (signature, key) = (self.header.signature(), target.key_of(&self.header));
        self.signature = key.and_then(|key| Verification::new(&self.hash, CONTEXT, signature, key));
        if self.signature.is_some() { Ok(false) } else { Err(Refusal::Signature) }
    }
}
