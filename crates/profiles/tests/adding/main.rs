//! Example of an added profile: its folder, and one line of the list. docs/extending.md explains it.

mod switches;

use canopen::ErrorClass;
use canopen::dictionary::Group;
use profiles::board::{Inputs, PositionInputs, PowerOn, RawEncoder, RawSample, Retained};
use profiles::{encoder, personalities};

personalities! {
    Encoder => encoder, "encoder.eds", "Encoder, CiA 406";
    Switches => switches, "switches.eds", "Switches and lamps, CiA 401";
}

/// The sampling half, the protocol half, and the values that they exchange, as in the node.
struct Node {
    image: [u8; IMAGE_SIZE],
    profile: AnyProfile,
    measurement: Measurement,
    snapshot: Snapshot,
}

impl Node {
    fn new() -> Node {
        let mut image = [0; IMAGE_SIZE];
        Personality::Switches.dictionary().load_defaults(&mut image);
        let profile = AnyProfile::new(Personality::Switches);
        let measurement = Measurement::new(Personality::Switches, &PowerOn::default());
        Node { image, profile, measurement, snapshot: Snapshot::Nothing }
    }

    fn sample(&mut self, digital: [bool; 2]) {
        self.measurement.apply(&self.profile.parameters(&self.image));
        let analogue =
            RawSample { pressure: 0, supply: 0, temperature: 0, reference: 0, thermistor: 0, count: 1 };
        let inputs = Inputs { analogue, position: RawEncoder::default(), digital };
        self.measurement.update(&inputs, &mut self.snapshot);
        self.profile.publish(&self.snapshot, &mut self.image);
    }

    fn read(&self, index: u16, sub: u8) -> u8 {
        Personality::Switches.dictionary().field(index, sub).get(&self.image)[0]
    }

    fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), canopen::sdo::Abort> {
        let entry = Personality::Switches.dictionary().find(index, sub)?;
        // As in the device: the profile is asked about the objects that it handles.
        if switches::handles(index, sub) {
            self.profile.write(&entry, bytes, &mut self.image)?;
        }
        entry.field().set(&mut self.image, bytes);
        self.profile.written(&entry, &mut self.image);
        Ok(())
    }
}

#[test]
fn the_list_selects_the_profile_by_its_number() {
    assert_eq!(Personality::numbered(1), Some(Personality::Switches));
    assert_eq!(Personality::default(), Personality::Encoder);
    let rows = Personality::Switches.rows();
    assert!(rows.iter().any(|row| row.index == 0x1018), "what every device has is there");
    assert!(rows.windows(2).all(|pair| pair[0].key() < pair[1].key()));
    assert!(Personality::Switches.has_group(Group::Application));
    assert!(!Personality::Switches.has_group(Group::Calibration));
    assert_eq!(Personality::Switches.file_name(), "switches.eds");
    assert_eq!(Personality::Switches.description(), "Switches and lamps, CiA 401");
    assert!(packed_size(Group::Application) > 0 && FAULTS.len() == encoder::FAULTS.len());
}

#[test]
fn the_profile_measures_and_shows_its_values() {
    let mut node = Node::new();
    for digital in [[false; 2], [true, false], [true, true], [false, true], [true, true]] {
        node.sample(digital);
    }
    assert_eq!((node.read(0x6000, 1), node.read(0x2400, 1), node.read(0x2400, 2)), (3, 2, 1));
    node.write(0x6002, 1, &[0b10]).unwrap();
    node.sample([true, true]);
    assert_eq!(node.read(0x6000, 1), 1);
}

#[test]
fn it_decides_on_its_own_objects_and_lights_its_lamps() {
    let mut node = Node::new();
    node.sample([true, true]);
    assert_eq!(node.write(0x2401, 0, b"nero"), Err(canopen::sdo::Abort::NotStored));
    node.write(0x2401, 0, b"zero").unwrap();
    node.sample([true, true]);
    assert_eq!((node.read(0x2400, 1), node.read(0x2400, 2)), (0, 0));
    node.write(0x6200, 1, &[0b10]).unwrap();
    assert_eq!(node.profile.outputs(&node.image).digital, [false, true]);
}

#[test]
fn the_profile_receives_syncs_and_errors() {
    let mut node = Node::new();
    node.sample([true, true]);
    assert_eq!(node.read(0x2403, 0), 0);
    node.profile.synchronised(None, &mut node.image);
    assert_eq!(node.read(0x2403, 0), 3);
    node.write(0x6200, 1, &[0b11]).unwrap();
    node.write(0x6206, 1, &[0b01]).unwrap();
    node.profile.error(ErrorClass::COMMUNICATION, &mut node.image);
    assert_eq!(node.profile.outputs(&node.image).digital, [false, true]);
}

#[test]
fn another_personality_is_left_alone() {
    let mut node = Node::new();
    let before = node.image;
    node.profile.publish(&Snapshot::Encoder(encoder::Snapshot::default()), &mut node.image);
    assert_eq!(node.image, before);
    assert_eq!(node.measurement.retained(), Retained::Nothing);
    assert_eq!(node.profile.parameters(&node.image).position_inputs(), PositionInputs::default());
}
