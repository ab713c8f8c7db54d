use crate::board::PowerOn;
use crate::board::{Inputs, RawEncoder, RawSample};
use crate::communication::{SELF_TEST_ROW, TRANSFER_BUFFER, UPDATE_LOG_ROW, personality};
use crate::lift::catalogue::{CobId, Content, PDOS as CATALOGUE};
use crate::lift::load::{FULL_LOAD, OVERLOAD, ZERO_LOAD};
use crate::lift::position::{INVERTED, UNKNOWN};
use crate::lift::word::Light;
use crate::lift::{Lift, Parameters};
use crate::pressure::objects::CALIBRATION;
use crate::profile::Chain;
use canopen::dictionary::{Access, Entry, Group, Rule};
use canopen::sdo::Abort;

use super::*;
use crate::{IMAGE_SIZE, Personality};

mod panel;

const DICTIONARY: &Dictionary = Personality::Lift.dictionary();
static FIELDS: Fields = fields(DICTIONARY);

fn rows() -> impl Iterator<Item = &'static Object> {
    Personality::Lift.rows().iter()
}

/// A dictionary with a lift behind it.
struct Node {
    image: [u8; IMAGE_SIZE],
    objects: Objects,
    lift: Lift,
    inputs: Inputs,
}

/// Readings at this share of the pressure range (0 to 10 bar), in per mille.
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
        let objects = Objects::new(&FIELDS);
        let mut node = Node { image: defaults(), objects, lift: Lift::new(&PowerOn::default()), inputs };
        node.write(0x2310, 1, 0).unwrap();
        node.sample();
        node
    }

    fn sample(&mut self) {
        let mut snapshot = Snapshot::default();
        self.lift.update(&self.inputs, &mut snapshot);
        self.objects.publish(&snapshot, &mut self.image);
    }

    /// The next call in the virtual input.
    fn call(&mut self) -> Option<u64> {
        self.objects.next_event(INPUTS, &mut self.image).then(|| self.read(0x6010, 0))
    }

    /// Receives a virtual output from the bus.
    fn output(&mut self, word: i64) -> [bool; 2] {
        self.write(0x6011, 0, word).unwrap();
        self.objects.received(OUTPUTS, &mut self.image);
        self.lit()
    }

    fn lit(&self) -> [bool; 2] {
        self.objects.outputs(&self.image).digital
    }

    /// Moves the sensor to this count, in steps of 200 mm / 4096.
    fn go_to(&mut self, counter: u16) {
        self.inputs.position.counter = counter;
        self.sample();
    }

    /// Writes as the device does: first the rule, then the bytes. The parameters arrive before the next sample.
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
    let personality = personality(Personality::Lift.number(), Personality::ALL.len());
    let common = [personality, SELF_TEST_ROW, UPDATE_LOG_ROW, TRANSFER_BUFFER];
    let others = || CALIBRATION.iter().chain(&common);
    let application = rows().filter(|row| row.index >= 0x2000);
    let own = application.filter(|row| !others().any(|other| other.index == row.index));
    let others: Vec<u16> = own
        .filter(|row| (row.access == Access::ReadWrite) != (row.group == Some(Group::Application)))
        .map(|row| row.index)
        .collect();
    assert_eq!(others, [0x2306, 0x2306, 0x2306, 0x2306, 0x2322, 0x2322, 0x6011], "presets, outputs");
}

/// Except for the trial of a program, the words of the panel and the lift number, which do not concern the measurement,
/// and the values that a preset and a reference weight leave behind.
#[test]
fn every_parameter_reaches_the_measurement() {
    let silent = [0x2002, 0x2320, 0x2321, 0x6001, 0x6100, 0x6120, 0x6200, 0x6382, 0x6486];
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
    // The measurement has not taken the preset yet: an earlier sample must not show the old position.
    node.write_late(0x6382, 1, 77_000).unwrap();
    assert_eq!(node.read(0x6383, 1), 77_000);
    node.sample();
    assert_eq!(node.read(0x6383, 1), 77_000);
    node.lift.apply(&FIELDS.parameters(&node.image));
    node.go_to(20_480 + 2048);
    assert_eq!((node.read(0x6383, 1), node.read(0x2302, 1)), (77_100, 76_000));
    // The offset is a parameter: a reset that loads it from the store gives the same position.
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
    // A sensor step is 48.8 um, so a measuring step of 10 um is too fine.
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
    assert_eq!(node.read(0x63C4, 1), 0x102D);
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
fn an_unmeasured_load_is_no_reference() {
    let mut node = Node::new();
    node.inputs.analogue.pressure = 0;
    node.sample();
    assert_eq!((node.read(0x6480, 1), node.read(0x2313, 2)), (0xFFFF, 1));
    assert_eq!(node.write(0x6486, 0, 0), Err(Abort::DeviceState));
    node.write_real(0x2311, 3, 0.0);
    node.sample();
    assert_eq!((node.read(0x6480, 1), node.read(0x2313, 2)), (0xFFFF, 1), "no characteristic");
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

/// One index for each unit (CiA 417), as in the limits.
#[test]
fn the_area_state_of_a_unit_follows_its_own_limits_and_is_sent() {
    let mut node = Node::new();
    node.write(0x2305, 0, 1).unwrap();
    node.write(0x2301, 2, 1).unwrap();
    for sub in 1..=2 {
        node.sample();
        node.write(0x6382, sub, 5000).unwrap();
    }
    node.write(0x63B8, 1, 4999).unwrap();
    node.write(0x63B5, 1, 5001).unwrap();
    node.sample();
    assert_eq!([0x63B0, 0x63B1, 0x63B2].map(|index| node.read(index, 1)), [2, 4, 0]);
    assert_eq!([1, 2].map(|sub| node.read(0x2303, sub)), [2, 4], "2303h has the same bits");
    let is_sent = |index, sub| node.objects.broadcasts(Multiplexer { index, sub }, &node.image);
    assert!(is_sent(0x63B0, 1) && is_sent(0x63B1, 1));
    assert!(!is_sent(0x63B2, 1), "a unit without a sensor");
    assert!(!is_sent(0x6390, 1), "each change of a speed would be a frame");
}

/// The choice determines the device type, the list and the PDOs. A unit without a sensor has no PDO.
#[test]
fn the_choice_of_virtual_devices() {
    let mut node = Node::new();
    let list = |node: &Node| [0, 1, 2, 3, 4].map(|sub| node.read(0x6000, sub));
    let on =
        |node: &Node| [0x1901, 0x1906, 0x1907, 0x1980, 0x1981].map(|index| node.read(index, 1) >> 31 == 0);
    assert_eq!((node.read(0x1000, 0), list(&node), on(&node)), (0x1A1, [0; 5], [false; 5]), "as delivered");
    for (chosen, device_type, types, valid) in [
        (1, 0x0600_01A1, [1, 0x0600, 0, 0, 0], [false, true, false, false, false]),
        (2, 0x0A00_01A1, [1, 0x0A00, 0, 0, 0], [true, false, false, false, false]),
        (4, 0x0200_01A1, [1, 0x0200, 0, 0, 0], [false; 5]),
        (8, 0x0300_01A1, [1, 0x0300, 0, 0, 0], [false; 5]),
        (15, 0x0000_01A1, [4, 0x0600, 0x0A00, 0x0200, 0x0300], [true, true, false, false, false]),
        (0, 0x0000_01A1, [0; 5], [false; 5]),
    ] {
        node.write(0x2305, 0, chosen).unwrap();
        assert_eq!((node.read(0x1000, 0), list(&node), on(&node)), (device_type, types, valid), "{chosen}");
    }
    node.write(0x2305, 0, 1).unwrap();
    node.write(0x2301, 3, 1).unwrap();
    node.write(0x2301, 1, 0).unwrap();
    assert_eq!(on(&node), [false, false, false, true, false], "units with a sensor");
}

/// The stored PDO parameters may be older than the stored choice.
#[test]
fn a_reset_silences_deselected_devices() {
    let mut node = Node::new();
    node.write(0x2305, 0, 3).unwrap();
    DICTIONARY.field(0x2305, 0).set(&mut node.image, &[2]);
    node.objects.initialise(&mut node.image, canopen::dictionary::Groups::NONE);
    assert_eq!([0x1901, 0x1906].map(|index| node.read(index, 1) >> 31), [0, 1]);
    assert_eq!((node.read(0x1000, 0), node.read(0x6000, 1)), (0x0A00_01A1, 0x0A00));
}

#[test]
fn a_virtual_device_that_is_not_chosen_has_no_faults() {
    let active = |devices| {
        let mut snapshot = Snapshot { devices, ..Snapshot::default() };
        snapshot.load.is_broken = true;
        let mut count = 0;
        Objects::faults(&snapshot, &mut |_, is_active| count += u32::from(is_active));
        count
    };
    assert_eq!([Devices(0), Devices::POSITION, Devices::LOAD].map(active), [0, 0, 1]);
}

/// The objects of the device agree with the catalogue.
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

/// A shared identifier would put two PDOs into one frame.
#[test]
fn no_two_pdos_share_an_identifier() {
    let mut ids: Vec<i64> = rows().filter(|row| row.rule() == Rule::PdoPredefined).map(cob_id).collect();
    assert_eq!(ids.len(), 15);
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 15);
}

/// With a node-ID whose multiplexed PDO is not among those received.
fn cob_id(row: &Object) -> i64 {
    match row.default {
        dictionary::DefaultValue::Integer(value) => value & 0x7FF,
        dictionary::DefaultValue::NodeId(base) => i64::from(base & 0x7FF) + 33,
        _ => panic!("no COB-ID"),
    }
}
