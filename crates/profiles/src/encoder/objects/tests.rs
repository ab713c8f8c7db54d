use crate::board::{RawEncoder, SsiFrame};
use crate::encoder::{ALARM_POSITION, Encoder, Parameters, SENSOR_NO_SIGNAL};
use crate::profile::Chain;
use canopen::dictionary::{Access, Group};
use canopen::sdo::Abort;

use super::*;
use crate::{IMAGE_SIZE, Personality};

const DICTIONARY: &Dictionary = Personality::Encoder.dictionary();
static FIELDS: Fields = fields(DICTIONARY);

/// A dictionary with an encoder behind it.
struct Node {
    image: [u8; IMAGE_SIZE],
    encoder: Encoder,
    raw: RawEncoder,
}

fn defaults() -> [u8; IMAGE_SIZE] {
    let mut image = [0; IMAGE_SIZE];
    DICTIONARY.load_defaults(&mut image);
    image
}

impl Node {
    fn new() -> Node {
        let mut node = Node { image: defaults(), encoder: Encoder::default(), raw: RawEncoder::default() };
        node.encoder.apply(&FIELDS.parameters(&node.image));
        node.sample();
        node
    }

    fn sample(&mut self) {
        let snapshot = self.encoder.sample(&self.raw);
        FIELDS.publish(&snapshot, &mut self.image);
    }

    fn turn_to(&mut self, counter: u16) {
        self.raw.counter = counter;
        self.sample();
    }

    /// Writes as the device does: first the rule, then the bytes. The parameters arrive before the next sample.
    fn write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), Abort> {
        self.write_late(index, sub, value)?;
        self.encoder.apply(&FIELDS.parameters(&self.image));
        Ok(())
    }

    fn write_late(&mut self, index: u16, sub: u8, value: i64) -> Result<(), Abort> {
        let entry = DICTIONARY.find(index, sub)?;
        let size = entry.field().get(&self.image).len();
        let bytes = &value.to_le_bytes()[..size];
        FIELDS.write(&entry, bytes, &mut self.image)?;
        entry.field().set(&mut self.image, bytes);
        Ok(())
    }

    fn read(&self, index: u16, sub: u8) -> u32 {
        let bytes = DICTIONARY.find(index, sub).unwrap().field().get(&self.image);
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
    }
}

#[test]
fn the_defaults_of_the_table_are_those_of_the_measurement() {
    assert_eq!(FIELDS.parameters(&defaults()), Parameters::default());
}

/// The objects of the encoder.
fn own() -> impl Iterator<Item = &'static Object> {
    SENSORS.iter().chain(&PROFILE)
}

#[test]
fn every_parameter_is_saved_and_nothing_else() {
    // The cyclic timer is saved as 1800h:5; the offsets follow from presets.
    let others: Vec<u16> = own()
        .filter(|row| (row.access == Access::ReadWrite) != (row.group == Some(Group::Application)))
        .map(|row| row.index)
        .collect();
    assert_eq!(others, [0x6200, 0x650C, 0x650C]);
}

#[test]
fn every_parameter_reaches_the_measurement() {
    // Values that differ from the default, are allowed, and keep the rest allowed.
    let special = |index, sub| match (index, sub) {
        (0x6000, _) => 2,
        (0x2103, 3) | (0x2105, _) => 0,
        (0x6005, 1) => 20_000,
        _ => 5,
    };
    // The threshold and the preset input concern the objects alone.
    let silent = [0x2112, 0x2115];
    let parameters = own().filter(|row| row.group == Some(Group::Application));
    for row in parameters.filter(|row| !silent.contains(&row.index)) {
        let mut node = Node::new();
        node.write(0x2108, 0, i64::from(u32::from_le_bytes(*b"fact"))).unwrap();
        node.write(0x2100, 2, 7).unwrap();
        let before = FIELDS.parameters(&node.image);
        let value = match row.limits {
            Some((low, high)) => i64::clamp(special(row.index, row.sub), low, high),
            None => special(row.index, row.sub),
        };
        if (row.index, row.sub) == (0x2100, 1) {
            node.write(row.index, row.sub, 4).unwrap();
        } else {
            node.write(row.index, row.sub, value).unwrap();
        }
        assert_ne!(FIELDS.parameters(&node.image), before, "{:X}h:{}", row.index, row.sub);
    }
}

#[test]
fn a_preset_is_read_at_once_and_stays() {
    for (index, sub) in [(0x6003, 0), (0x6010, 1)] {
        let mut node = Node::new();
        node.turn_to(1000);
        assert_eq!(node.read(0x6004, 0), 1000);
        // The measurement has not taken the preset yet: an earlier sample must not show the old position.
        node.write_late(index, sub, 77).unwrap();
        assert_eq!((node.read(0x6004, 0), node.read(0x6020, 1)), (77, 77));
        node.sample();
        assert_eq!((node.read(0x6004, 0), node.read(0x6020, 1)), (77, 77));
        node.encoder.apply(&FIELDS.parameters(&node.image));
        node.sample();
        let offset = (77_i32 - 1000).cast_unsigned();
        assert_eq!((node.read(0x6004, 0), node.read(0x6509, 0), node.read(0x650C, 1)), (77, offset, offset));
        assert_eq!((node.read(0x6003, 0), node.read(0x6010, 1), node.read(0x6010, 2)), (77, 77, 0));
        node.turn_to(1010);
        assert_eq!((node.read(0x6004, 0), node.read(0x6020, 1)), (87, 87));
        // A second write of the same preset acts as a preset again.
        node.write(index, sub, 77).unwrap();
        node.sample();
        assert_eq!(node.read(0x6004, 0), 77);
    }
}

#[test]
fn a_preset_outside_of_the_range_or_without_a_position_is_refused() {
    let mut node = Node::new();
    assert_eq!(node.write(0x6003, 0, 4096 * 4096), Err(Abort::InvalidValue));
    assert_eq!(node.write(0x6003, 0, 4096 * 4096 - 1), Ok(()));
    assert_eq!(node.write(0x6010, 2, 0), Err(Abort::DeviceState), "there is no channel 2");
    node.write(0x2100, 1, 2).unwrap();
    node.sample();
    assert_eq!(node.read(0x210B, 1) & u32::from(SENSOR_NO_SIGNAL), u32::from(SENSOR_NO_SIGNAL));
    assert_eq!(node.write(0x6003, 0, 1), Err(Abort::DeviceState), "there is no SSI encoder");
}

#[test]
fn a_negative_preset_of_a_channel_is_a_high_position() {
    let mut node = Node::new();
    node.write(0x2100, 1, 7).unwrap();
    node.write(0x6005, 1, 4096).unwrap();
    node.sample();
    node.write(0x6010, 1, -5).unwrap();
    node.sample();
    assert_eq!((node.read(0x6020, 1).cast_signed(), node.read(0x6004, 0)), (-5, u32::MAX - 4));
}

#[test]
fn a_turn_a_range_or_a_step_of_nothing_is_refused() {
    let mut node = Node::new();
    for (index, sub, value, result) in [
        (0x6001, 0, 0, Err(Abort::InvalidValue)),
        (0x6001, 0, 0xFFFF_FFFF, Ok(())),
        (0x6001, 0, 3600, Ok(())),
        (0x6002, 0, 0, Err(Abort::InvalidValue)),
        (0x6002, 0, 0xFFFF_FFFF, Ok(())),
        (0x6002, 0, 36_000, Ok(())),
        (0x6005, 1, 0, Err(Abort::InvalidValue)),
    ] {
        assert_eq!(node.write(index, sub, value), result, "{index:X}h = {value}");
    }
    node.write(0x2100, 1, 6).unwrap();
    // A measuring step may be finer than the sensor (CiA 406, 7.2.6).
    node.write(0x2101, 1, 10_001).unwrap();
    for operating in [4, 0] {
        node.write(0x6000, 0, operating).unwrap();
        node.write(0x6005, 1, 1).unwrap();
    }
}

#[test]
fn operating_parameters_that_mean_nothing_are_refused() {
    let mut node = Node::new();
    for (value, result) in [
        (0x0001, Ok(())),
        (0x0007, Ok(())),
        (0x0008, Err(Abort::InvalidValue)),
        (0x0010, Err(Abort::InvalidValue)),
        (0x8000, Err(Abort::InvalidValue)),
    ] {
        assert_eq!(node.write(0x6000, 0, value), result, "{value:X}h");
    }
    node.sample();
    assert_eq!(node.read(0x6500, 0), 7);
    node.write(0x6000, 0, 0).unwrap();
    node.write(0x2100, 1, 6).unwrap();
    assert_eq!(node.write(0x6000, 0, 1), Err(Abort::InvalidValue));
    assert_eq!(node.write(0x6000, 0, 8), Ok(()));
    node.sample();
    assert_eq!(node.read(0x6500, 0), 0x000A);
}

#[test]
fn a_frame_that_cannot_be_is_refused() {
    let mut node = Node::new();
    node.write(0x2103, 1, 16).unwrap();
    assert_eq!(node.write(0x2103, 2, 17), Err(Abort::InvalidValue));
    assert_eq!(node.read(0x2103, 2), 13);
    assert_eq!(node.write(0x2103, 2, 16), Ok(()));
}

#[test]
fn factory_data_is_locked_and_shows_in_the_module_identification() {
    let mut node = Node::new();
    assert_eq!(node.write(0x2107, 1, 100), Err(Abort::DeviceState));
    node.write(0x2108, 0, i64::from(u32::from_le_bytes(*b"fact"))).unwrap();
    for (sub, value) in [(1, 100), (2, 50), (3, 2000)] {
        node.write(0x2107, sub, value).unwrap();
    }
    node.sample();
    assert_eq!([1, 2, 3].map(|sub| node.read(0x650A, sub)), [100, 50, 2000]);
    assert_eq!(node.read(0x6004, 0), 100);
    node.turn_to(2000);
    assert_eq!(node.read(0x6400, 1), 1);
    node.write(0x2108, 0, 0).unwrap();
    assert_eq!(node.write(0x2107, 1, 0), Err(Abort::DeviceState));
}

#[test]
fn alarms_stay_until_they_are_acknowledged() {
    let mut node = Node::new();
    node.write(0x2100, 1, 2).unwrap();
    (0..3).for_each(|_| node.sample());
    assert_eq!(node.read(0x6503, 0), ALARM_POSITION.into());
    node.write(0x2109, 0, 1).unwrap();
    node.sample();
    assert_eq!(node.read(0x6503, 0), ALARM_POSITION.into(), "the cause is still there");
    node.raw.ssi = Some(SsiFrame { bits: 1 << 26, clocks: 27 });
    node.sample();
    assert_eq!(node.read(0x6503, 0), ALARM_POSITION.into(), "nobody has seen it yet");
    node.write(0x2109, 0, 2).unwrap();
    node.sample();
    assert_eq!(node.read(0x6503, 0), ALARM_POSITION.into(), "another one was acknowledged");
    node.write(0x2109, 0, 1).unwrap();
    node.sample();
    assert_eq!(node.read(0x6503, 0), 0);
}

/// The dictionary starts afresh and the measurement does not. No command is carried out again, and values are taken.
#[test]
fn a_reset_of_the_dictionary_repeats_no_command() {
    let mut node = Node::new();
    node.turn_to(1000);
    node.write(0x6003, 0, 77).unwrap();
    node.sample();
    node.image = defaults();
    node.sample();
    node.encoder.apply(&FIELDS.parameters(&node.image));
    node.turn_to(1001);
    assert_eq!(node.read(0x6004, 0), 78);
    node.write(0x6003, 0, 5).unwrap();
    node.sample();
    assert_eq!(node.read(0x6004, 0), 5);
}

#[test]
fn the_type_follows_the_sensors() {
    let mut node = Node::new();
    assert_eq!(FIELDS.parameters(&node.image).encoder_type(), 5);
    node.write(0x2100, 1, 8).unwrap();
    assert_eq!(FIELDS.parameters(&node.image).encoder_type(), 8);
    node.write(0x2100, 2, 5).unwrap();
    assert_eq!(FIELDS.parameters(&node.image).encoder_type(), 10);
}

#[test]
fn resolution_and_revolutions_are_those_of_the_first_sensor() {
    let mut node = Node::new();
    node.sample();
    assert_eq!((node.read(0x6501, 0), node.read(0x6502, 0)), (4096, 4096));
    node.write(0x2100, 1, 2).unwrap();
    node.sample();
    assert_eq!((node.read(0x6501, 0), node.read(0x6502, 0)), (8192, 4096));
}
