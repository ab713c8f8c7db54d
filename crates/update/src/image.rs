//! An image in flash: its header, and the stepwise checks of its code.

use core::ops::Range;

use storage::checksum::Digest;

use crate::area::Area;
use crate::flash::{CHUNK, Flash, PIECES, read_piece};
use crate::header::{HEADER, Header};
use crate::key::{KEYS_CONTEXT, Rank};
use crate::refusal::Refusal;
use crate::seal::seal;
use crate::signature::{CONTEXT, HASH_LEN, Message, Verification, hash};
use crate::target::{Target, image_len};

/// Reads the header at the start of `area`. The image may run on this node, provided that the rest of it is valid.
pub(crate) fn admitted<F: Flash>(
    flash: &mut F,
    target: &Target,
    area: Area,
    header: &mut Header,
) -> Result<(), Refusal> {
    header.read(flash, area)?;
    target.admit(flash, header)
}

/// Range of the code of an image in `area`.
pub(crate) fn code(header: &Header, area: Area) -> Range<u32> {
    let start = area.start();
    start.saturating_add(HEADER)..start.saturating_add(image_len(header))
}

/// The most that an image raises the security counter. The root key may set a higher counter to begin from.
pub const COUNTER_STEP: u32 = 16;

/// Reads the header of the staged image. It may replace the application: it may run on this node, its security counter is
/// not lower than the application's, which may not have been recorded yet, and does not rise by more than [`COUNTER_STEP`].
pub(crate) fn candidate<F: Flash>(
    flash: &mut F,
    target: &Target,
    staged: &mut Header,
) -> Result<(), Refusal> {
    let is_whole = staged.read(flash, target.layout.application()).is_ok();
    let least = if is_whole { staged.counter() } else { 0 };
    admitted(flash, target, target.layout.staging(), staged)?;
    let from = target.security().least_counter(flash).max(staged.certified_counter());
    let most = from.saturating_add(COUNTER_STEP);
    if staged.counter() < least {
        Err(Refusal::Counter { least })
    } else if staged.counter() > most {
        Err(Refusal::CounterStep { most })
    } else {
        Ok(())
    }
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
        CrcCheck { expected: header.code_crc(), rest: code(header, area), digest: storage::checksum::begin() }
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

/// A full check of an image in progress: first its content, then the certificates in its header, from the highest rank on,
/// then its signature. Each signature is verified twice, so that a single skipped instruction or wrong bit spoils only one of
/// the two verifications.
pub(crate) struct FullCheck {
    header: Header,
    crc: CrcCheck,
    /// `None` if the signature is not checked.
    message: Option<Message>,
    hash: [u8; HASH_LEN],
    signature: Option<Verification>,
    /// Number of verifications that are not complete.
    rest: u32,
    /// The word of the verifications so far.
    word: u32,
}

/// Number of verifications of each signature.
const TWICE: u32 = 2;
/// The constant that each complete verification adds to the word, so that none can be left out.
const VERIFIED: u32 = 0x9E37_79B9;

impl FullCheck {
    /// A check of the staged image.
    pub(crate) fn new<F: Flash>(flash: &mut F, target: &Target) -> Result<FullCheck, Refusal> {
        let mut header = Header::EMPTY;
        candidate(flash, target, &mut header)?;
        Ok(FullCheck::of(&header, target.layout.staging(), true))
    }

    /// A check of the image with this header in an area, with or without its signature.
    pub(crate) fn of(header: &Header, area: Area, is_signed: bool) -> FullCheck {
        FullCheck {
            header: *header,
            crc: CrcCheck::new(header, area),
            message: is_signed.then(|| Message::of(header)),
            hash: [0; HASH_LEN],
            signature: None,
            rest: verifications(header),
            word: header.crc(),
        }
    }

    /// The header of the image.
    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// Does one step; returns whether the whole check has passed.
    pub(crate) fn step<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<bool, Refusal> {
        let rank = self.rank();
        let Some(signature) = &mut self.signature else { return self.read(flash, target) };
        match signature.step() {
            None => return Ok(false),
            Some(false) => return Err(Refusal::Signature),
            Some(true) => {}
        }
        // The key is looked up again, because the verification may have used a wrong one.
        let key = target.key(&self.header, rank);
        self.word = seal(signature.seal(self.word), signature.key(), key).wrapping_add(VERIFIED);
        self.rest = self.rest.wrapping_sub(1);
        if self.rest == 0 { Ok(true) } else { self.verify(target) }
    }

    /// The CRC of the header once all verifications have found the signatures valid; another word before that, and with
    /// any other signature.
    pub(crate) fn seal(&self) -> u32 {
        self.word.wrapping_sub(VERIFIED.wrapping_mul(verifications(&self.header)))
    }

    fn read<F: Flash>(&mut self, flash: &mut F, target: &Target) -> Result<bool, Refusal> {
        if !self.crc.step(flash, &mut self.message)? {
            return Ok(false);
        }
        let Some(message) = self.message.take() else { return Ok(true) };
        self.hash = message.end();
        self.verify(target)
    }

    /// The rank of the key of the verification in progress.
    fn rank(&self) -> Rank {
        match self.rest {
            0..=TWICE => Rank::Release,
            3..=4 => Rank::Root,
            _ => Rank::Recovery,
        }
    }

    /// Starts a verification of the signature.
    fn verify(&mut self, target: &Target) -> Result<bool, Refusal> {
        let rank = self.rank();
        let key = target.key(&self.header, rank);
        let (hash, context, signature) = match self.header.signed_by(rank) {
            None => (self.hash, CONTEXT, self.header.signature()),
            Some((message, signature)) => (hash(&[message]), KEYS_CONTEXT, signature),
        };
        self.signature = Verification::new(&hash, context, signature, key);
        if self.signature.is_some() { Ok(false) } else { Err(Refusal::Signature) }
    }
}

/// Number of verifications that an image with this header needs.
fn verifications(header: &Header) -> u32 {
    let certificates =
        u32::from(header.generation() != 0).wrapping_add((header.root_generation() != 0).into());
    certificates.wrapping_add(1).wrapping_mul(TWICE)
}
