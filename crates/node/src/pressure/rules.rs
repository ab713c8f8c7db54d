//! Rules of the profile's own objects.

use super::Fields;
use canopen::dictionary::Entry;
use canopen::sdo::Abort;
use profiles::pressure::{STATUS_INVALID, Unit};

/// What 6125h takes: "zero".
const ZERO_SIGNATURE: [u8; 4] = *b"zero";

impl Fields {
    /// Whether an object that is handled is one of the transmitter.
    pub(crate) fn decides_on(&self, entry: &Entry) -> bool {
        matches!(entry.index(), 0x2200..=0x22FF) || matches!(self.index(entry), 0x6125 | 0x6131)
    }

    /// The index that the object has where the transmitter is the only device.
    fn index(&self, entry: &Entry) -> u16 {
        entry.index().wrapping_sub(self.shift)
    }

    /// Decides on a write to an object that is handled.
    pub(crate) fn write(&self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if matches!(entry.index(), 0x2200..=0x22FF) {
            return self.calibration.write(entry, bytes, image);
        }
        let code = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let known = match (self.index(entry), entry.sub()) {
            (0x6125, _) => return self.autozero(entry.sub(), bytes, image),
            (0x6131, 1) => Unit::pressure(code).is_some(),
            (0x6131, 2) => Unit::temperature(code).is_some(),
            _ => true,
        };
        if known { Ok(()) } else { Err(Abort::InvalidValue) }
    }

    /// Moves the offset so that the present process value becomes 0. A value that is not valid is no reference.
    fn autozero(&self, sub: u8, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if bytes != ZERO_SIGNATURE {
            return Err(Abort::NotStored);
        }
        let channel = if sub == 1 { &self.pressure } else { &self.temperature };
        if channel.status.u8(image) & STATUS_INVALID != 0 {
            return Err(Abort::DeviceState);
        }
        let offset = channel.offset.f32(image) - channel.process_value.f32(image);
        channel.offset.store(image, offset.to_le_bytes());
        Ok(())
    }
}
