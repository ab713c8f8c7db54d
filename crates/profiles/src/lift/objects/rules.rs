//! Checks and actions on writes to objects of the lift.

use super::values::{Fields, UnitFields};
use crate::lift::devices::Devices;
use crate::lift::position::{INVERTED, NO_OFFSET, NOT_REFERENCED, Source, UNKNOWN};
use crate::pressure::objects::calibration;
use canopen::dictionary::{Entry, Field};
use canopen::sdo::Abort;

/// The rules for the lift's objects.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// 6380h: the direction of a unit.
    Operating,
    /// 6382h: the position becomes the preset.
    Preset,
    /// 6384h:1, 2300h, 2100h to 2103h: measuring step, travel and sensors, which define the units of positions.
    Measure,
    /// 6486h: the load that is in the car now.
    Reference,
    /// 2301h: the sensor of a unit.
    Source,
    /// 2305h: the virtual devices of the node.
    Devices,
    /// 6100h: the word of a button.
    Input,
    /// 2200h to 2203h: the calibration of the transducer.
    Calibration(calibration::Rule),
}

impl Rule {
    /// The rule of an object.
    pub(super) const fn of(index: u16, sub: u8) -> Option<Rule> {
        Some(match (index, sub) {
            (0x2100..=0x2103, 1..) | (0x2300, 0) | (0x6384, 1) => Rule::Measure,
            (0x2301, 1..) => Rule::Source,
            (0x2305, 0) => Rule::Devices,
            (0x6100, 1..) => Rule::Input,
            (0x6380, 1..) => Rule::Operating,
            (0x6382, 1..) => Rule::Preset,
            (0x6486, 0) => Rule::Reference,
            _ => match calibration::Rule::of(index, sub) {
                Some(rule) => Rule::Calibration(rule),
                None => return None,
            },
        })
    }
}

impl Fields {
    /// Checks a write to an object that has one of the rules above.
    pub(super) fn write(&self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let Some(rule) = Rule::of(entry.index(), entry.sub()) else { return Ok(()) };
        let unit = usize::from(entry.sub()).wrapping_sub(1);
        let value = word(bytes);
        match rule {
            Rule::Operating => self.operate(unit, value, image),
            Rule::Preset => self.preset(unit, value, image),
            Rule::Measure => self.change_unit(entry.field(), bytes, image),
            Rule::Source => self.take_source(unit, entry.field(), bytes, image),
            Rule::Devices => {
                self.choose(Devices(value.to_le_bytes()[0]), true, image);
                Ok(())
            }
            Rule::Input => {
                self.panel.take_input(unit, bytes, image);
                Ok(())
            }
            Rule::Reference => self.weigh(value, image),
            Rule::Calibration(rule) => self.transducer.write(rule, entry, bytes, image),
        }
    }

    /// Changes the direction of a unit. The position stays the same, so the offset changes.
    fn operate(&self, number: usize, value: u32, image: &mut [u8]) -> Result<(), Abort> {
        let operating = u16::try_from(value).ok().filter(|bits| bits & !INVERTED == 0);
        let operating = operating.ok_or(Abort::InvalidValue)?;
        let unit = self.unit(number)?;
        if operating != unit.operating.u16(image) {
            let position = unit.position.u32(image);
            let turned = self.position_parameters(image).turned(number, position);
            unit.offset.store(image, turned.unwrap_or(0).to_le_bytes());
            // The other direction does not change a position; an unknown one needs a preset.
            if unit.state.u8(image) & (UNKNOWN | NOT_REFERENCED) != 0 && unit.references.u8(image) != 0 {
                unit.references.store(image, [NO_OFFSET]);
            }
        }
        Ok(())
    }

    /// Computes the offset for a preset. The position already shows the preset, so the next read returns it.
    fn preset(&self, number: usize, preset: u32, image: &mut [u8]) -> Result<(), Abort> {
        let unit = self.unit(number)?;
        let has_source = Source::from_code(unit.source.u8(image)).is_some();
        if !has_source || unit.state.u8(image) & (UNKNOWN | NOT_REFERENCED) == UNKNOWN {
            return Err(Abort::DeviceState);
        }
        let position = unit.reading.u32(image);
        let offset = self.position_parameters(image).preset(number, position, preset);
        unit.offset.store(image, offset.ok_or(Abort::InvalidValue)?.to_le_bytes());
        unit.position.store(image, preset.to_le_bytes());
        // Another preset before the next sample starts from this one.
        unit.reading.store(image, preset.to_le_bytes());
        let references = unit.references.u8(image);
        let next = if references < NO_OFFSET - 1 { references + 1 } else { 1 };
        unit.references.store(image, [next]);
        Ok(())
    }

    /// Tries another measuring step, travel or sensor; one that a sensor cannot give is refused. In other units the
    /// offsets have lost their meaning and become 0, as in CiA 406.
    fn change_unit(&self, field: Field, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let before = Value::of(field, image);
        field.set(image, bytes);
        let is_possible = self.sensors.has_format(image) && self.position_parameters(image).is_consistent();
        field.set(image, before.bytes());
        if !is_possible {
            return Err(Abort::InvalidValue);
        }
        if bytes != before.bytes() {
            self.units.iter().for_each(|unit| unit.drop_offset(image));
        }
        Ok(())
    }

    fn take_source(&self, number: usize, field: Field, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if bytes != field.get(image) {
            self.unit(number)?.drop_offset(image);
        }
        self.switch_position(number, bytes != [0], image);
        Ok(())
    }

    /// Takes the load that is in the car now as reference. Refused while the load is not measured.
    fn weigh(&self, kilograms: u32, image: &mut [u8]) -> Result<(), Abort> {
        let is_measured = self.load_parameters(image).is_calibrated() && self.load_state.u8(image) == 0;
        let reference = u16::try_from(kilograms).map_err(|_| Abort::InvalidValue)?;
        if !is_measured {
            return Err(Abort::DeviceState);
        }
        let offset = self.load_offset.f32(image) + f32::from(reference) - self.measured_load.f32(image);
        self.load_offset.store(image, offset.to_le_bytes());
        self.measured_load.store(image, f32::from(reference).to_le_bytes());
        self.load.store(image, reference.to_le_bytes());
        Ok(())
    }

    fn unit(&self, number: usize) -> Result<&UnitFields, Abort> {
        self.units.get(number).ok_or(Abort::General)
    }
}

/// The number in at most four bytes.
fn word(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// A value of at most four bytes.
struct Value {
    bytes: [u8; 4],
    len: usize,
}

impl Value {
    fn of(field: Field, image: &[u8]) -> Value {
        let value = field.get(image);
        Value { bytes: word(value).to_le_bytes(), len: value.len() }
    }

    fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }
}
