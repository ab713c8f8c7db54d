//! Checks and actions on writes to objects of the transmitter.

use super::Fields;
use super::calibration;
use crate::pressure::Unit;
use canopen::dictionary::Entry;
use canopen::sdo::Abort;

/// The rules for the transmitter's objects.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// 6125h: the present process value becomes 0.
    Autozero,
    /// 6131h:1: only units of pressure are accepted.
    PressureUnit,
    /// 6131h:2: only units of temperature are accepted.
    TemperatureUnit,
    /// 2200h to 2203h: the calibration.
    Calibration(calibration::Rule),
}

impl Rule {
    /// The rule of an object: in the device profile, by its index without a shift; or in the manufacturer's range.
    pub(super) const fn of(index: u16, sub: u8) -> Option<Rule> {
        match (index, sub) {
            (0x6125, 1..) => Some(Rule::Autozero),
            (0x6131, 1) => Some(Rule::PressureUnit),
            (0x6131, 2) => Some(Rule::TemperatureUnit),
            _ => match calibration::Rule::of(index, sub) {
                Some(rule) => Some(Rule::Calibration(rule)),
                None => None,
            },
        }
    }

    /// Like [`Rule::of`], for a device in which `shift` is added to the indexes of the device profile.
    pub(super) const fn shifted(index: u16, sub: u8, shift: u16) -> Option<Rule> {
        if index < 0x6000 { Rule::of(index, sub) } else { Rule::of(index.wrapping_sub(shift), sub) }
    }
}

/// The value of 6125h that starts the autozero: "zero".
const ZERO_SIGNATURE: [u8; 4] = *b"zero";

impl Fields {
    /// Checks a write to an object that has one of the rules above.
    /// `is_measured`: whether each channel shows the value of an intact sensor.
    pub(super) fn write(
        &self,
        entry: &Entry,
        bytes: &[u8],
        is_measured: [bool; 2],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        let code = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let is_known = match Rule::shifted(entry.index(), entry.sub(), self.shift) {
            Some(Rule::Autozero) => {
                return self.autozero(entry.sub(), bytes, is_measured, image);
            }
            Some(Rule::Calibration(rule)) => return self.calibration.write(rule, entry, bytes, image),
            Some(Rule::PressureUnit) => Unit::pressure(code).is_some(),
            Some(Rule::TemperatureUnit) => Unit::temperature(code).is_some(),
            None => true,
        };
        if is_known { Ok(()) } else { Err(Abort::InvalidValue) }
    }

    /// Changes the offset so that the present process value becomes 0. Refused while the sensor gives no value; whether
    /// the integer formats can show the value does not matter.
    fn autozero(
        &self,
        sub: u8,
        bytes: &[u8],
        [pressure, temperature]: [bool; 2],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        if bytes != ZERO_SIGNATURE {
            return Err(Abort::NotStored);
        }
        let (channel, is_measured) =
            if sub == 1 { (&self.pressure, pressure) } else { (&self.temperature, temperature) };
        let value = channel.process_value.f32(image);
        // The largest value stands for one that no REAL32 can show.
        if !is_measured || value.abs() >= f32::MAX {
            return Err(Abort::DeviceState);
        }
        let offset = channel.offset.f32(image) - value;
        channel.offset.store(image, offset.to_le_bytes());
        Ok(())
    }
}
