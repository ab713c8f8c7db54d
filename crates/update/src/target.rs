//! What this node is, and whether an image is for it.

use crate::area::Layout;
use crate::header::{HEADER, Header};
use crate::key::KEY_LEN;
use crate::refusal::Refusal;

/// What an image must fit.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Where things are in flash.
    pub layout: Layout,
    /// The product (1018h:2).
    pub product: u32,
    /// The hardware revision, 0 to 31.
    pub hardware: u8,
    /// The public key that images are signed with; [`crate::key::PUBLIC_KEY`] in the product.
    pub key: [u8; KEY_LEN],
}

impl Target {
    /// Whether the image is for this product and hardware, and not longer than the application area.
    pub(crate) fn admit(&self, header: &Header) -> Result<(), Refusal> {
        let about = header.description();
        if about.product != self.product {
            Err(Refusal::Product { expected: self.product })
        } else if about.hardware.checked_shr(self.hardware.into()).unwrap_or(0) & 1 == 0 {
            Err(Refusal::Hardware { revision: self.hardware })
        } else if image_len(header) > self.layout.application().size() {
            Err(Refusal::TooLong)
        } else {
            Ok(())
        }
    }
}

/// Bytes of header and code.
pub(crate) fn image_len(header: &Header) -> u32 {
    header.length().saturating_add(HEADER)
}
