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
    /// 6139h: the present process value becomes 0 by a tare.
    Autotare,
    /// 6503h: a process value, or none.
    AlarmLink,
    /// 6133h and 650Bh: threshold and hysteresis, which are widths.
    Width,
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
            (0x6139, 1..) => Some(Rule::Autotare),
            (0x6503, 1..) => Some(Rule::AlarmLink),
            (0x6133 | 0x650B, 1..) => Some(Rule::Width),
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

/// The value of 6125h that starts the autozero: "zero". `TARE_SIGNATURE`: that of 6139h, "tare".
const ZERO_SIGNATURE: [u8; 4] = *b"zero";
const TARE_SIGNATURE: [u8; 4] = *b"tare";

impl Fields {
    /// Checks a write to an object that has one of the rules above.
    /// `measured`: the process value of each channel without its offset, from an intact sensor.
    pub(super) fn write(
        &self,
        entry: &Entry,
        bytes: &[u8],
        measured: [Option<f32>; 2],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        let code = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let is_known = match Rule::shifted(entry.index(), entry.sub(), self.shift) {
            Some(Rule::Autozero) => {
                return self.zero(entry.sub(), bytes == ZERO_SIGNATURE, false, measured, image);
            }
            Some(Rule::Autotare) => {
                return self.zero(entry.sub(), bytes == TARE_SIGNATURE, true, measured, image);
            }
            Some(Rule::AlarmLink) => self.functions.can_link(code),
            Some(Rule::Calibration(rule)) => {
                self.calibration.write(rule, entry, bytes, image)?;
                if (entry.index(), entry.sub()) == (0x2200, 1) || (entry.index(), entry.sub()) == (0x2200, 2)
                {
                    self.follow_range(entry, f32::from_bits(code), image);
                }
                return Ok(());
            }
            Some(Rule::Width) => f32::from_bits(code) >= 0.0,
            Some(Rule::PressureUnit) => Unit::pressure(code).is_some(),
            Some(Rule::TemperatureUnit) => Unit::temperature(code).is_some(),
            None => true,
        };
        if is_known { Ok(()) } else { Err(Abort::InvalidValue) }
    }

    /// Changes the offset, or the tare, so that the present process value becomes 0; a new offset ends the tare. Refused while the sensor gives no value; whether
    /// the integer formats can show the value does not matter.
    fn zero(
        &self,
        sub: u8,
        is_signed: bool,
        is_tare: bool,
        [pressure, temperature]: [Option<f32>; 2],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        if !is_signed {
            return Err(Abort::NotStored);
        }
        let (channel, measured) =
            if sub == 1 { (&self.pressure, pressure) } else { (&self.temperature, temperature) };
        let measured = measured.ok_or(Abort::DeviceState)?;
        let offset = if is_tare { channel.offset.f32(image) } else { -measured };
        let tare = if is_tare { measured + offset } else { 0.0 };
        // The largest value stands for one that no REAL32 can show.
        if !tare.is_finite() {
            return Err(Abort::DeviceState);
        }
        channel.offset.store(image, offset.to_le_bytes());
        channel.tare.store(image, tare.to_le_bytes());
        Ok(())
    }

    /// The default span of the pressure (6148h, 6149h) is the range of the transducer.
    #[inline(never)]
    pub(super) fn default_spans(&self, image: &mut [u8]) {
        let unit = self.pressure_unit(image);
        for (span, limit) in
            [self.pressure.span.start, self.pressure.span.end].iter().zip(self.calibration.range())
        {
            span.store(image, unit.of(limit.f32(image)).to_le_bytes());
        }
    }

    /// A span that is the range of the transducer follows a write to 2200h:1 or 2200h:2.
    #[inline(never)]
    fn follow_range(&self, entry: &Entry, pascal: f32, image: &mut [u8]) {
        let unit = self.pressure_unit(image);
        let span = if entry.sub() == 1 { self.pressure.span.start } else { self.pressure.span.end };
        if span.f32(image).to_bits() == unit.of(entry.field().f32(image)).to_bits() {
            span.store(image, unit.of(pascal).to_le_bytes());
        }
    }
}
