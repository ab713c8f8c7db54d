//! Rules of the profile's own objects.

use super::Fields;
use super::calibration::{LOCK, VALUE};
use canopen::dictionary::Entry;
use canopen::sdo::Abort;
use profiles::pressure::{STATUS_INVALID, Unit};

/// 6125h.
pub(super) const AUTOZERO: u8 = 0;
/// 6131h:1.
pub(super) const PRESSURE_UNIT: u8 = 1;
/// 6131h:2.
pub(super) const TEMPERATURE_UNIT: u8 = 2;

/// What 6125h takes: "zero".
const ZERO_SIGNATURE: [u8; 4] = *b"zero";

impl Fields {
    /// Decides on a write to an object with one of the rules above.
    pub(crate) fn write(&self, rule: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let code = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let known = match rule {
            AUTOZERO => return self.autozero(entry.sub(), bytes, image),
            VALUE..=LOCK => return self.calibration.write(rule, entry, bytes, image),
            PRESSURE_UNIT => Unit::pressure(code).is_some(),
            TEMPERATURE_UNIT => Unit::temperature(code).is_some(),
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
