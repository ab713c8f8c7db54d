use crate::board::PowerOn;
use crate::board::{Inputs, RawEncoder, RawSample};
use crate::communication::{TRANSFER_BUFFER, personality};
use crate::lift::catalogue::{CobId, Content, PDOS as CATALOGUE};
use crate::lift::load::{FULL_LOAD, OVERLOAD, ZERO_LOAD};
use crate::lift::panel::Lamp;
use crate::lift::position::{INVERTED, UNKNOWN};
use crate::lift::{Lift, Parameters};
use crate::pressure::objects::CALIBRATION;
use crate::profile::Chain;
use canopen::dictionary::{Access, Entry, Group, Rule};
use canopen::sdo::Abort;

use super::*;
use crate::{IMAGE_SIZE, Personality};

const DICTIONARY: &Dictionary = Personality::Lift.dictionary();
static FIELDS: Fields = fields(DICTIONARY);

fn rows() -> impl Iterator<Item = &'static Object> {
    Personality::Lift.rows().iter()
}

/// A dictionary with a lift behind it.
struct Node {
    image: [u8; IMAGE_SIZE],
    lift: Lift,
    inputs: Inputs,
}

/// Readings at this share of the pressure range, 0 to 10 bar, in per mille.
fn pressure(permille: u32) -> RawSample {
    let supply = 16 * 4000;
    RawSample {
        pressure: supply / 10 + permille * (supply / 10 * 8) / 1000,
        supply,
        temperature: 0,
        thermistor: 0,
        reference: 0,
        count: 16,
    }
}

fn defaults() -> [u8; IMAGE_SIZE] {
    let mut image = [0; IMAGE_SIZE];
    DICTIONARY.load_defaults(&mut image);
    image
}

impl Node {
    fn new() -> Node {
        let inputs = Inputs { analogue: pressure(0), position: RawEncoder::default(), digital: [false; 2] };
        let mut node = Node { image: defaults(), lift: Lift::new(&PowerOn::default()), inputs };
        node.write(0x2310, 1, 0).unwrap();
        node.sample();
        node
    }

    fn sample(&mut self) {
        let mut snapshot = Snapshot::default();
        self.lift.update(&self.inputs, &mut snapshot);
        FIELDS.publish(&snapshot, &mut self.image);
    }

    /// Goes to this way in sensor steps of 200 mm / 4096.
    fn go_to(&mut self, counter: u16) {
        self.inputs.position.counter = counter;
        self.sample();
    }

    /// As the device does it: the rule, then the bytes; the parameters arrive before the next sample.
    fn write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), Abort> {
        self.write_late(index, sub, value)?;
        self.lift.apply(&FIELDS.parameters(&self.image));
        Ok(())
    }

    fn write_late(&mut self, index: u16, sub: u8, value: i64) -> Result<(), Abort> {
        let entry = DICTIONARY.find(index, sub)?;
        let size = entry.field().get(&self.image).len();
        self.write_bytes(&entry, &value.to_le_bytes()[..size])
    }

    fn write_bytes(&mut self, entry: &Entry, bytes: &[u8]) -> Result<(), Abort> {
        FIELDS.write(entry, bytes, &mut self.image)?;
        entry.field().set(&mut self.image, bytes);
        Ok(())
    }

    fn write_real(&mut self, index: u16, sub: u8, value: f32) {
        let entry = DICTIONARY.find(index, sub).unwrap();
        self.write_bytes(&entry, &value.to_le_bytes()).unwrap();
        self.lift.apply(&FIELDS.parameters(&self.image));
    }

    fn read(&self, index: u16, sub: u8) -> u64 {
        let bytes = DICTIONARY.find(index, sub).unwrap().field().get(&self.image);
        bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }
}

#[test]
fn the_defaults_of_the_table_are_those_of_the_measurement() {
    assert_eq!(FIELDS.parameters(&defaults()), Parameters::default());
}

#[test]
fn every_parameter_is_saved_and_nothing_else() {
    let common = [personality(Personality::Lift.number(), Personality::ALL.len()), TRANSFER_BUFFER];
    let others = || CALIBRATION.iter().chain(&common);
    let application = rows().filter(|row| row.index >= 0x2000);
    let own = application.filter(|row| !others().any(|other| other.index == row.index));
    let others: Vec<u16> = own
        .filter(|row| (row.access == Access::ReadWrite) != (row.group == Some(Group::Application)))
        .map(|row| row.index)
        .collect();
    assert_eq!(others, [0x2322, 0x2322, 0x6011], "outputs");
}

/// But for the words of the panel and the lift number, which do not concern the measurement, and what a preset and a
/// reference weight leave behind.
#[test]
fn every_parameter_changes_what_the_measurement_gets() {
    let silent = [0x2320, 0x2321, 0x6001, 0x6382, 0x6486];
    let special = |index, sub| match (index, sub) {
        (0x2105 | 0x2301, _) | (0x2103, 3) => 0,
        (0x2101, _) => 8000,
        (0x2300, _) => 300_000,
        (0x6380, _) => INVERTED.into(),
        (0x6384, 1) => 200,
        _ => 5,
    };
    let parameters = rows().filter(|row| row.group == Some(Group::Application));
    for row in parameters.filter(|row| !silent.contains(&row.index)) {
        let mut node = Node::new();
        node.write(0x2100, 2, 7).unwrap();
        (2..=4).for_each(|sub| node.write(0x2301, sub, 1).unwrap());
        let before = FIELDS.parameters(&node.image);
        let (low, high) = row.limits.or(row.kind.range()).unwrap_or((i64::MIN, i64::MAX));
        let value = match (row.index, row.sub) {
            (0x2100, 1) => 4,
            (index, sub) => special(index, sub).clamp(low, high),
        };
        node.write(row.index, row.sub, value).unwrap();
        assert_ne!(FIELDS.parameters(&node.image), before, "{:X}h:{}", row.index, row.sub);
    }
}

#[test]
fn a_preset_is_read_at_once_and_stays() {
    let mut node = Node::new();
    node.go_to(20_480);
    assert_eq!(node.read(0x6383, 1), 1000);
    // Not yet taken by the measurement: a sample from before must not show the old position.
    node.write_late(0x6382, 1, 77_000).unwrap();
    assert_eq!(node.read(0x6383, 1), 77_000);
    node.sample();
    assert_eq!(node.read(0x6383, 1), 77_000);
    node.lift.apply(&FIELDS.parameters(&node.image));
    node.go_to(20_480 + 2048);
    assert_eq!((node.read(0x6383, 1), node.read(0x2302, 1)), (77_100, 76_000));
    // It is a parameter: after a reset that finds it stored it is the same.
    let stored = node.image;
    node.image = defaults();
    DICTIONARY.field(0x2302, 1).set(&mut node.image, DICTIONARY.field(0x2302, 1).get(&stored));
    node.lift.apply(&FIELDS.parameters(&node.image));
    node.sample();
    assert_eq!(node.read(0x6383, 1), 77_100);
}

#[test]
fn a_preset_without_a_position_or_beyond_the_sensor_is_refused() {
    let mut node = Node::new();
    assert_eq!(node.write(0x6382, 1, 4096 * 200), Err(Abort::InvalidValue));
    assert_eq!(node.write(0x6382, 2, 1), Err(Abort::DeviceState), "there is no unit 2");
    node.write(0x2100, 1, 2).unwrap();
    node.sample();
    assert_eq!(node.read(0x2303, 1) & u64::from(UNKNOWN), u64::from(UNKNOWN));
    assert_eq!(node.write(0x6382, 1, 1), Err(Abort::DeviceState), "there is no SSI encoder");
}

#[test]
fn the_other_direction_leaves_the_position() {
    let mut node = Node::new();
    node.write(0x6382, 1, 5000).unwrap();
    node.go_to(2048);
    assert_eq!(node.write(0x6380, 1, 1), Err(Abort::InvalidValue), "a bit that means nothing");
    node.write(0x6380, 1, 8).unwrap();
    node.sample();
    assert_eq!((node.read(0x6383, 1), node.read(0x63C0, 1)), (5100, 0x0D));
    node.go_to(4096);
    assert_eq!(node.read(0x6383, 1), 5000);
    node.write(0x6380, 1, 8).unwrap();
    node.sample();
    assert_eq!(node.read(0x6383, 1), 5000, "the same again changes nothing");
}

#[test]
fn another_measuring_step_clears_the_offset_and_must_be_one_of_the_sensor() {
    for (index, sub, value, position) in [(0x6384, 1, 50, 200), (0x2300, 0, 400_000, 200)] {
        let mut node = Node::new();
        node.go_to(2048);
        node.write(0x6382, 1, 5000).unwrap();
        node.write(index, sub, value).unwrap();
        node.sample();
        assert_eq!((node.read(0x2302, 1), node.read(0x6383, 1)), (0, position), "{index:X}h");
    }
    let mut node = Node::new();
    node.write(0x6382, 1, 5000).unwrap();
    // A sensor step is 48.8 um: 10 um is finer.
    for (index, sub, value) in [(0x6384, 1, 4), (0x2101, 1, 199), (0x2103, 2, 31)] {
        assert_eq!(node.write(index, sub, value), Err(Abort::InvalidValue), "{index:X}h");
    }
    assert_eq!((node.read(0x2302, 1), node.read(0x6384, 1), node.read(0x2101, 1)), (5000, 100, 4096));
    assert_eq!(node.write(0x6384, 1, 5), Ok(()));
}

#[test]
fn units_take_their_sensor_where_the_table_says() {
    let mut node = Node::new();
    node.write(0x2301, 3, 1).unwrap();
    node.go_to(2048);
    assert_eq!([1, 2, 3, 4].map(|unit| node.read(0x6383, unit)), [100, 0, 100, 0]);
    node.write(0x6382, 3, 1).unwrap();
    node.write(0x2301, 3, 2).unwrap();
    assert_eq!(node.read(0x2302, 3), 0, "the offset belonged to the other sensor");
    assert_eq!(node.read(0x63C4, 1), 0x3D);
}

#[test]
fn the_load_is_signalled_and_its_reference_is_the_load_of_now() {
    let mut node = Node::new();
    for (sub, kilograms) in [(1, 50), (3, 600), (4, 700)] {
        node.write(0x6483, sub, kilograms).unwrap();
    }
    for (permille, load, signals) in
        [(0, 0, ZERO_LOAD), (650, 650, FULL_LOAD), (750, 750, FULL_LOAD | OVERLOAD)]
    {
        node.inputs.analogue = pressure(permille);
        node.sample();
        assert_eq!((node.read(0x6480, 1), node.read(0x6482, 1)), (load, signals.into()), "{permille}");
    }
    node.write_late(0x6486, 0, 100).unwrap();
    assert_eq!(node.read(0x6480, 1), 100);
    node.sample();
    assert_eq!(node.read(0x6480, 1), 100, "a sample from before shows nothing old");
    node.lift.apply(&FIELDS.parameters(&node.image));
    node.inputs.analogue = pressure(800);
    node.sample();
    assert_eq!((node.read(0x6480, 1), node.read(0x6482, 1)), (150, 0));
}

#[test]
fn what_is_not_weighed_is_no_reference() {
    let mut node = Node::new();
    node.inputs.analogue.pressure = 0;
    node.sample();
    assert_eq!((node.read(0x6480, 1), node.read(0x2313, 2)), (0xFFFF, 1));
    assert_eq!(node.write(0x6486, 0, 0), Err(Abort::DeviceState));
    node.write_real(0x2311, 3, 0.0);
    node.sample();
    assert_eq!((node.read(0x6480, 1), node.read(0x2313, 2)), (0, 0), "no load measuring unit");
    assert_eq!(node.write(0x6486, 0, 0), Err(Abort::DeviceState));
}

#[test]
fn the_transducer_is_calibrated_as_that_of_the_pressure_transmitter() {
    let mut node = Node::new();
    let key = u32::from_le_bytes(*b"cali").into();
    assert_eq!(node.write(0x2200, 2, 0x4A74_2400), Err(Abort::DeviceState), "locked");
    node.write(0x2203, 0, key).unwrap();
    // 0 to 40 bar.
    node.write_real(0x2200, 2, 4.0e6);
    node.inputs.analogue = pressure(100);
    node.sample();
    assert_eq!(node.read(0x6480, 1), 400);
}

#[test]
fn a_button_is_a_word_and_a_word_is_a_lamp() {
    let mut node = Node::new();
    let words = [(1, 0x11), (2, 0x9988_7766_5544), (3, 0x12), (4, 0x13)];
    for (sub, word) in words {
        node.write(0x2320, sub, word).unwrap();
    }
    node.sample();
    assert_eq!(node.read(0x6010, 0), 0x11);
    // The second button is told a millisecond after the first, and what was told last stays.
    for (buttons, word) in [
        ([true, true], 0x9988_7766_5544),
        ([true, true], 0x13),
        ([false, true], 0x11),
        ([false, false], 0x12),
        ([false, false], 0x12),
    ] {
        node.inputs.digital = buttons;
        node.sample();
        assert_eq!(node.read(0x6010, 0), word, "{buttons:?}");
    }
    let words = [(1, 0x22), (2, 0x33), (3, 0x55), (4, 0x33)];
    for (sub, word) in words {
        node.write(0x2321, sub, word).unwrap();
    }
    let mut lamps = [Lamp::default(); 2];
    for (word, lit) in [
        (0x33, [true, true]),
        (0x44, [true, true]),
        (0x22, [false, true]),
        (0x55, [false, false]),
        (0, [false, false]),
    ] {
        node.write(0x6011, 0, word).unwrap();
        FIELDS.follow_output(&mut lamps, &mut node.image);
        assert_eq!(FIELDS.lit(&node.image), lit, "{word:X}h");
    }
    node.write(0x2322, 2, 1).unwrap();
    FIELDS.follow_output(&mut lamps, &mut node.image);
    assert_eq!(FIELDS.lit(&node.image), [false, true], "an old output says nothing new");
}

#[test]
fn a_button_that_is_not_used_says_nothing() {
    let mut node = Node::new();
    node.write(0x2320, 3, 0x12).unwrap();
    node.write(0x2320, 4, 0x13).unwrap();
    for (buttons, word) in [([true, false], 0), ([true, true], 0x13), ([false, true], 0x13)] {
        node.inputs.digital = buttons;
        node.sample();
        assert_eq!(node.read(0x6010, 0), word, "{buttons:?}");
    }
}

#[test]
fn the_device_type_names_the_only_virtual_device_or_none() {
    let mut node = Node::new();
    let device_type = |node: &Node| FIELDS.device_type(&node.image);
    assert_eq!(device_type(&node), 0x0000_01A1, "position and load");
    node.write_real(0x2311, 3, 0.0);
    assert_eq!(device_type(&node), 0x0600_01A1);
    node.write(0x2301, 1, 0).unwrap();
    assert_eq!(device_type(&node), 0x0000_01A1, "nothing");
    node.write(0x2320, 1, 7).unwrap();
    assert_eq!(device_type(&node), 0x0200_01A1);
    node.write(0x2320, 1, 0).unwrap();
    node.write(0x2321, 1, 7).unwrap();
    assert_eq!(device_type(&node), 0x0300_01A1);
    node.write(0x2321, 1, 0).unwrap();
    node.write_real(0x2311, 3, 1.0);
    assert_eq!(device_type(&node), 0x0A00_01A1);
}

/// What the catalogue says of a PDO is what the device reads in the objects.
#[test]
fn the_pdos_are_those_of_the_catalogue() {
    let row = |index, sub| rows().find(|row| (row.index, row.sub) == (index, sub));
    let value = |index, sub| match row(index, sub)?.default {
        dictionary::DefaultValue::Integer(value) => Some(value),
        dictionary::DefaultValue::NodeId(base) => Some(base.into()),
        _ => None,
    };
    let produced: Vec<u16> =
        CATALOGUE.iter().filter(|pdo| row(pdo.tpdo_index(), 1).is_some()).map(|pdo| pdo.number).collect();
    assert_eq!(produced, [2, 130, 258, 263, 264, 385, 386]);
    for pdo in CATALOGUE.iter().filter(|pdo| produced.contains(&pdo.number)) {
        let index = pdo.tpdo_index();
        let (CobId::Fixed(id) | CobId::PlusNode(id)) = pdo.cob_id;
        assert_eq!(value(index, 1).unwrap() & 0x7FF, i64::from(id), "{}", pdo.name);
        assert_eq!([2, 3, 5].map(|sub| value(index, sub).unwrap()), [255, 0, 0]);
        match pdo.content {
            Content::Multiplexed => assert_eq!(value(index + 0x200, 0), Some(0xFF)),
            Content::Objects(objects) => {
                let mapped: Vec<i64> = (1..=8).map_while(|sub| value(index + 0x200, sub)).collect();
                assert_eq!(mapped, objects.iter().map(|object| object.entry().into()).collect::<Vec<i64>>());
                assert_eq!(value(index + 0x200, 0), Some(objects.len().try_into().unwrap()));
            }
        }
    }
}

/// An identifier twice would be two PDOs in one frame.
#[test]
fn no_two_pdos_share_an_identifier() {
    let mut ids: Vec<i64> = rows().filter(|row| row.rule == Rule::PdoPredefined).map(cob_id).collect();
    assert_eq!(ids.len(), 15);
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 15);
}

/// With a node-ID that is none of the producers' whose multiplexed PDOs are received.
fn cob_id(row: &Object) -> i64 {
    match row.default {
        dictionary::DefaultValue::Integer(value) => value & 0x7FF,
        dictionary::DefaultValue::NodeId(base) => i64::from(base & 0x7FF) + 33,
        _ => panic!("no COB-ID"),
    }
}
