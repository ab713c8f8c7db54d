//! Identity of this node, and whether an image is for it.

use crate::area::Layout;
use crate::flash::Flash;
use crate::header::{HEADER, Header};
use crate::key::{KEY_LEN, RANKS, Rank};
use crate::refusal::Refusal;
use crate::security::Security;

/// Properties of the node that an image must fit.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The areas in flash.
    pub layout: Layout,
    /// The board (2004h:1).
    pub board: u32,
    /// The hardware revision, 0 to 31.
    pub hardware: u8,
    /// The public keys by their rank; [`crate::key::PUBLIC_KEYS`] in the product.
    pub keys: &'static [[u8; KEY_LEN]; RANKS],
}

impl Target {
    /// The key of this rank for an image: that of its key list, or else of the bootloader.
    pub(crate) fn key<'a>(&self, header: &'a Header, rank: Rank) -> &'a [u8; KEY_LEN] {
        let [release, root, recovery] = self.keys;
        let own = match rank {
            Rank::Release => release,
            Rank::Root => root,
            Rank::Recovery => recovery,
        };
        header.certified_key(rank).unwrap_or(own)
    }

    /// The record of the security counter and the generation of keys.
    pub(crate) fn security(&self) -> Security {
        Security(self.layout.security())
    }

    /// Whether the image may run on this node in its present state, if its signature is valid.
    pub(crate) fn admit<F: Flash>(&self, flash: &mut F, header: &Header) -> Result<(), Refusal> {
        self.fits(header)?;
        self.security().admit(flash, header)
    }

    /// Whether the image is for this board and hardware, not too long, and has a counter that can be recorded.
    fn fits(&self, header: &Header) -> Result<(), Refusal> {
        if header.board() != self.board {
            Err(Refusal::Board { expected: self.board })
        } else if header.hardware().checked_shr(self.hardware.into()).unwrap_or(0) & 1 == 0 {
            Err(Refusal::Hardware { revision: self.hardware })
        } else if image_len(header) > self.layout.longest_image() {
            Err(Refusal::TooLong)
        } else if header.counter() > self.layout.highest_counter() {
            Err(Refusal::HeaderContent)
        } else {
            Ok(())
        }
    }
}

/// Length of header and code in bytes.
pub(crate) fn image_len(header: &Header) -> u32 {
    header.length().saturating_add(HEADER)
}
