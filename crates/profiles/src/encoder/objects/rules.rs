//! Checks and actions on writes to objects of the encoder.

use super::values::Fields;
use crate::encoder::{
    COMMISSIONING, ChannelParameters, Parameters, SCALING, SENSOR_NO_SIGNAL, SENSOR_PARITY,
};
use canopen::dictionary::{Entry, Field};
use canopen::sdo::Abort;

/// The rules for the encoder's objects.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// 6000h: reserved bits, and direction bits that apply to no sensor, are refused.
    Operating,
    /// 6001h, 6002h and 6005h:1: all of UNSIGNED32 (CiA 406, 7.2.2, 7.2.3, 7.2.6) but 0, because a turn, a range or a step
    /// of 0 is impossible.
    Range,
    /// 6003h and 6010h: the position becomes the preset.
    Preset,
    /// 2100h to 2103h, 2114h: description of a sensor and its gear.
    Sensor,
    /// 2107h: locked by 2108h.
    Factory,
    /// 2109h: clears alarms.
    Acknowledge,
}

impl Rule {
    /// The rule of an object.
    pub(super) const fn of(index: u16, sub: u8) -> Option<Rule> {
        Some(match (index, sub) {
            (0x2100..=0x2103, 1..) | (0x2114, 0) => Rule::Sensor,
            (0x2107, 1..) => Rule::Factory,
            (0x2109, 0) => Rule::Acknowledge,
            (0x6000, 0) => Rule::Operating,
            (0x6001 | 0x6002, 0) | (0x6005, 1) => Rule::Range,
            (0x6003, 0) | (0x6010, 1..) => Rule::Preset,
            _ => return None,
        })
    }
}

/// The value of 2108h that opens 2107h: "fact".
const FACTORY_SIGNATURE: [u8; 4] = *b"fact";

impl Fields {
    /// Checks a write to an object that has one of the rules above.
    pub(super) fn write(&self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let Some(rule) = Rule::of(entry.index(), entry.sub()) else { return Ok(()) };
        let mut word = [0; 4];
        word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let value = u32::from_le_bytes(word);
        match rule {
            Rule::Operating => allow(is_operating(&self.parameters(image), value)),
            Rule::Range => allow(value > 0),
            Rule::Preset => self.preset(entry, value, image),
            Rule::Sensor => self.describe_sensor(entry, bytes, image),
            Rule::Factory if self.factory_key.load(image) != FACTORY_SIGNATURE => Err(Abort::DeviceState),
            Rule::Factory => Ok(()),
            Rule::Acknowledge => {
                count(self.acknowledgements, image);
                Ok(())
            }
        }
    }

    /// Gives the command for a preset. The position already shows the preset, so the next read returns it.
    fn preset(&self, entry: &Entry, value: u32, image: &mut [u8]) -> Result<(), Abort> {
        let ([first, second], parameters) = (&self.channels, self.parameters(image));
        let [first_own, second_own] = &parameters.channels;
        let (channel, own) = if entry.sub() == 2 { (second, second_own) } else { (first, first_own) };
        check_preset(&parameters, own, channel.sensor_state.u8(image), value)?;
        count(channel.presets, image);
        channel.preset.store(image, value.to_le_bytes());
        channel.position.store(image, value.to_le_bytes());
        if entry.sub() != 2 {
            self.preset.store(image, value.to_le_bytes());
            self.position.store(image, value.to_le_bytes());
        }
        Ok(())
    }

    /// Tries the new description, and restores the old one. Refuses it when the active scaling would become impossible.
    fn describe_sensor(&self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let field = entry.field();
        let before = Saved::of(field, image);
        field.set(image, bytes);
        let result = allow(self.sensors.has_format(image) && self.parameters(image).is_consistent());
        field.set(image, before.bytes());
        result
    }
}

/// A preset needs a reading and must lie within the range. A reading that was rejected as implausible is accepted with
/// the preset.
fn check_preset(all: &Parameters, own: &ChannelParameters, state: u8, value: u32) -> Result<(), Abort> {
    match all.sensor(own) {
        Some(sensor) if state & (SENSOR_NO_SIGNAL | SENSOR_PARITY) == 0 => {
            allow(u64::from(value) < all.scale(&sensor).range().get())
        }
        _ => Err(Abort::DeviceState),
    }
}

/// A value of at most four bytes.
struct Saved {
    bytes: [u8; 4],
    len: usize,
}

impl Saved {
    fn of(field: Field, image: &[u8]) -> Saved {
        let mut bytes = [0; 4];
        let value = field.get(image);
        bytes.iter_mut().zip(value).for_each(|(to, from)| *to = *from);
        Saved { bytes, len: value.len() }
    }

    fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }
}

/// Refuses reserved bits, direction bits that apply to no sensor, and a scaling that a sensor cannot give.
fn is_operating(parameters: &Parameters, value: u32) -> bool {
    let Ok(operating) = u16::try_from(value) else { return false };
    let known = COMMISSIONING | SCALING | parameters.directions();
    operating & !known == 0 && Parameters { operating, ..*parameters }.is_consistent()
}

/// Counts a command. 0 appears only before the first command.
fn count(field: Field, image: &mut [u8]) {
    field.store(image, [field.u8(image).checked_add(1).unwrap_or(1)]);
}

fn allow(is_allowed: bool) -> Result<(), Abort> {
    if is_allowed { Ok(()) } else { Err(Abort::InvalidValue) }
}
