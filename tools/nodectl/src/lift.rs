//! The values in the pre-defined PDOs of a lift (CiA 417). CiA 417 defines their mapping, so no node has to be asked
//! for it.

use canopen::Frame;
use canopen::pdo::Mpdo;
use canopen::sdo::Multiplexer;
use profiles::lift::catalogue::{Content, Definition, Field, by_cob_id, name_of};

use crate::Catalogue;
use crate::object::at;
use crate::value::Value;

/// The device profile of a lift (1000h).
const PROFILE: u32 = 417;

/// Whether a device type (1000h) is that of a lift.
#[must_use]
pub fn is_lift(device_type: u32) -> bool {
    device_type & 0xFFFF == PROFILE
}

/// Whether CiA 417 fixes this CAN-ID, so that it does not tell the node that sends with it.
#[must_use]
pub fn is_fixed(can_id: u16) -> bool {
    by_cob_id(can_id.into()).is_some_and(|definition| definition.producer.is_none())
}

/// A value in a PDO.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The meaning of the PDO.
    pub pdo: &'static str,
    /// The node-ID of the sender, where the CAN-ID contains it.
    pub producer: Option<u8>,
    /// The object.
    pub at: Multiplexer,
    /// The name of the object; empty for an unknown object in a multiplexed PDO.
    pub name: String,
    /// The value.
    pub value: Value,
}

/// A decoder with the objects of a lift.
#[derive(Clone, Debug)]
pub struct Lift {
    /// The data sheet of this project's lift device, for its objects beyond the profile.
    sheet: Catalogue,
}

impl Default for Lift {
    fn default() -> Lift {
        Lift { sheet: Catalogue::of_file("lift.eds").unwrap_or_else(Catalogue::unknown) }
    }
}

impl Lift {
    /// The values in a frame; none where the frame is no PDO of the lift. A value that the frame does not contain
    /// completely is left out.
    #[must_use]
    pub fn readings(&self, frame: &Frame) -> Vec<Reading> {
        let Some(definition) = by_cob_id(frame.id().into()) else { return Vec::new() };
        match definition.pdo.content {
            Content::Multiplexed => self.multiplexed(definition, frame).into_iter().collect(),
            Content::Objects(_) => mapped(definition, frame.data()),
        }
    }

    fn multiplexed(&self, Definition { pdo, producer }: Definition, frame: &Frame) -> Option<Reading> {
        let Mpdo { at, data, .. } = Mpdo::parse(frame.data().try_into().ok()?)?;
        let known = name_of(at.index, at.sub).map(str::to_owned);
        let name = known.or_else(|| self.sheet.name(at)).unwrap_or_default();
        let value = match self.sheet.data_type(at) {
            Some(data_type) => Value::decode(&data, data_type),
            None => Value::Bytes(data.to_vec()),
        };
        Some(Reading { pdo: pdo.name, producer, at, name, value })
    }
}

fn mapped(definition: Definition, data: &[u8]) -> Vec<Reading> {
    let Definition { pdo, producer } = definition;
    let reading = |field: Field| {
        let object = field.object;
        let value = decode(field, field.value(data)?);
        let name = object.name.to_owned();
        Some(Reading { pdo: pdo.name, producer, at: at(object.index, object.sub), name, value })
    };
    definition.fields().filter_map(reading).collect()
}

/// Decodes a field. Fields of more than 32 bits have a structure that is not public, and stay bytes.
fn decode(Field { object, .. }: Field, word: u64) -> Value {
    match object.bits {
        33.. => Value::Bytes(word.to_le_bytes()[..usize::from(object.bits / 8)].to_vec()),
        bits if object.is_signed() => {
            let unused = 64 - u32::from(bits);
            Value::Integer((word << unused).cast_signed().wrapping_shr(unused).into())
        }
        _ => Value::Integer(word.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profiles::lift::catalogue::PDOS;

    fn readings(id: u16, data: &[u8]) -> Vec<(String, String)> {
        let readings = Lift::default().readings(&Frame::new(id, data).unwrap());
        readings.into_iter().map(|reading| (reading.name, reading.value.to_string())).collect()
    }

    fn texts(expected: &[(&str, &str)]) -> Vec<(String, String)> {
        expected.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    }

    #[test]
    fn every_pdo_has_all_its_values_by_name() {
        let lift = Lift::default();
        for pdo in PDOS {
            let Content::Objects(objects) = pdo.content else { continue };
            let bytes: usize = objects.iter().map(|object| usize::from(object.bits / 8)).sum();
            let frame = Frame::new(pdo.can_id(77), &[0x81; 8][..bytes]).unwrap();
            let readings = lift.readings(&frame);
            let names: Vec<&str> = readings.iter().map(|reading| reading.name.as_str()).collect();
            assert_eq!(names, objects.iter().map(|object| object.name).collect::<Vec<_>>());
            assert!(readings.iter().all(|reading| reading.pdo == pdo.name && !reading.name.is_empty()));
        }
    }

    #[test]
    fn numbers_have_their_sign_and_words_their_bytes() {
        let command = [0x0F, 0, 3, 0, 0x3C, 0xF6, 0xFF, 0xFF];
        let expected = [
            ("controlword", "15"),
            ("mode of operation", "3"),
            ("reserved", "0"),
            ("target velocity", "-2500"),
        ];
        assert_eq!(readings(0x182, &command), texts(&expected));
        assert_eq!(readings(0x18C, &[0xFF; 4]), texts(&[("position 1", "4294967295")]));
        assert_eq!(readings(0x491, &[0xCA, 0, 0, 4, 0, 1]), texts(&[("virtual input", "CA 00 00 04 00 01")]));
    }

    #[test]
    fn a_multiplexed_pdo_names_its_object() {
        let state = readings(0x510, &[0x80, 0x03, 0x23, 1, 2, 0, 0, 0]);
        assert_eq!(state, texts(&[("Position unit states/Position unit 1 state", "2")]));
        assert_eq!(readings(0x510, &[0x80, 0x83, 0x63, 2, 1, 1, 0, 0]), texts(&[("position 2", "257")]));
        assert_eq!(readings(0x510, &[0x80, 0, 0x50, 0, 1, 0, 0, 0]), texts(&[("", "01 00 00 00")]));
        assert_eq!(readings(0x510, &[0x80, 0x83]), []);
    }

    #[test]
    fn a_fixed_can_id_has_no_node() {
        assert!(is_fixed(0x18C) && is_lift(0x0000_01A1));
        assert!(!is_fixed(0x510) && !is_fixed(0x701) && !is_lift(0x0002_0194));
    }

    #[test]
    fn short_frames_and_frames_of_other_devices_are_ignored() {
        assert_eq!(readings(0x188, &[5, 1]), texts(&[("load signals", "5")]));
        assert_eq!(readings(0x1A1, &[0; 8]), []);
        assert_eq!(readings(0x701, &[5]), []);
    }
}
