//! The value that each TPDO has sent last, for change thresholds.

use canopen::dictionary::Field;

use crate::communication::PDOS;

/// A value of four bytes in each TPDO, by its position; 0 before the first transmission.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastSent([u32; PDOS]);

impl LastSent {
    pub(crate) const NEW: LastSent = LastSent([0; PDOS]);

    /// A TPDO has been sent with the value in the image.
    #[inline(never)]
    pub(crate) fn take(&mut self, tpdo: usize, value: Field, image: &[u8]) {
        if let Some(sent) = self.0.get_mut(tpdo % PDOS) {
            *sent = value.u32(image);
        }
    }

    /// The value in a TPDO.
    pub(crate) fn of(&self, tpdo: usize) -> u32 {
        self.0.get(tpdo % PDOS).copied().unwrap_or_default()
    }
}
