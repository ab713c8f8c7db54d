//! Measured values into the image, parameters out of it.

use crate::encoder::Area;
use crate::encoder::objects::Sensors;
use crate::lift::load::{self, Point};
use crate::lift::panel::{BUTTONS, Contact, LAMPS, Lamp};
use crate::lift::position::{self, Source, UNITS, UnitParameters, UnitValues};
use crate::lift::{Parameters, Snapshot};
use crate::pressure::objects::Places;
use canopen::dictionary::{Dictionary, Field};
use core::num::{NonZeroU16, NonZeroU32};

/// Where the lift's values are in the image of its dictionary.
#[derive(Debug)]
pub struct Fields {
    device_type: Field,
    pub(super) sensors: Sensors,
    pub(super) transducer: Places,
    pub(super) units: [UnitFields; UNITS],
    /// How often a preset has said where the sensor of a channel is.
    pub(super) references: [Field; 2],
    travel: Field,
    position_step: Field,
    speed_step: Field,
    pub(super) load: Field,
    signals: Field,
    limits: [Field; 4],
    filter_type: Field,
    filter_constant: Field,
    points: [[Field; 2]; 2],
    pub(super) load_offset: Field,
    pub(super) measured_load: Field,
    pub(super) load_state: Field,
    input: Field,
    output: Field,
    /// The words of a button while it is released and while it is pressed.
    buttons: [[Field; 2]; BUTTONS],
    /// The words that put a lamp out and that light it.
    lamp_words: [[Field; 2]; LAMPS],
    lamps: [Field; LAMPS],
}

/// Where the values of one position unit are.
#[derive(Debug)]
pub(super) struct UnitFields {
    pub(super) source: Field,
    pub(super) offset: Field,
    pub(super) state: Field,
    pub(super) operating: Field,
    pub(super) position: Field,
    pub(super) reading: Field,
    speed: Field,
    limits: [Field; 2],
    operating_status: Field,
    resolution: Field,
    revolutions: Field,
    warnings: Field,
}

impl UnitFields {
    const fn new(d: &Dictionary, sub: u8) -> UnitFields {
        UnitFields {
            source: d.field(0x2301, sub),
            offset: d.field(0x2302, sub),
            state: d.field(0x2303, sub),
            operating: d.field(0x6380, sub),
            position: d.field(0x6383, sub),
            reading: d.field(0x2304, sub),
            speed: d.field(0x6390, sub),
            limits: [d.field(0x63B4, sub), d.field(0x63B8, sub)],
            operating_status: d.field(0x63C0, sub),
            resolution: d.field(0x63C1, sub),
            revolutions: d.field(0x63C2, sub),
            warnings: d.field(0x63C5, sub),
        }
    }

    fn parameters(&self, image: &[u8]) -> UnitParameters {
        let [low, high] = self.limits.map(|at| integer(at, image));
        UnitParameters {
            source: Source::from_code(self.source.u8(image)),
            operating: self.operating.u16(image),
            offset: integer(self.offset, image),
            limits: Area { low, high },
        }
    }

    fn publish(&self, values: &UnitValues, image: &mut [u8]) {
        self.speed.store(image, values.speed.to_le_bytes());
        self.operating_status.store(image, values.operating_status.to_le_bytes());
        self.resolution.store(image, values.resolution.to_le_bytes());
        self.revolutions.store(image, values.revolutions.to_le_bytes());
        self.warnings.store(image, values.warnings.to_le_bytes());
        // A sample from before the last preset must not bring the old position back.
        if values.offset == integer(self.offset, image) {
            self.position.store(image, values.position.to_le_bytes());
            self.reading.store(image, values.reading.to_le_bytes());
            self.state.store(image, [values.state]);
        }
    }
}

impl Fields {
    /// Looks them up, during compilation.
    pub(crate) const fn new(d: &Dictionary) -> Fields {
        Fields {
            device_type: d.field(0x1000, 0),
            sensors: Sensors::new(d),
            transducer: Places::new(d),
            units: [
                UnitFields::new(d, 1),
                UnitFields::new(d, 2),
                UnitFields::new(d, 3),
                UnitFields::new(d, 4),
            ],
            references: pair(d, 0x2305, 1),
            travel: d.field(0x2300, 0),
            position_step: d.field(0x6384, 1),
            speed_step: d.field(0x6384, 2),
            load: d.field(0x6480, 1),
            signals: d.field(0x6482, 1),
            limits: [d.field(0x6483, 1), d.field(0x6483, 2), d.field(0x6483, 3), d.field(0x6483, 4)],
            filter_type: d.field(0x2310, 1),
            filter_constant: d.field(0x2310, 2),
            points: [pair(d, 0x2311, 1), pair(d, 0x2311, 3)],
            load_offset: d.field(0x2312, 0),
            measured_load: d.field(0x2313, 1),
            load_state: d.field(0x2313, 2),
            input: d.field(0x6010, 0),
            output: d.field(0x6011, 0),
            buttons: [pair(d, 0x2320, 1), pair(d, 0x2320, 3)],
            lamp_words: [pair(d, 0x2321, 1), pair(d, 0x2321, 3)],
            lamps: pair(d, 0x2322, 1),
        }
    }

    /// Takes a snapshot into the image.
    pub(crate) fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        for (unit, values) in self.units.iter().zip(&snapshot.position.units) {
            unit.publish(values, image);
        }
        self.publish_load(&snapshot.load, image);
        self.publish_input(snapshot.button, image);
    }

    /// Of a button that is used: the virtual input says what it has said before, whatever the others do.
    fn publish_input(&self, contact: Contact, image: &mut [u8]) {
        let Some(words) = self.buttons.get(contact.button).filter(|words| differ(**words, image)) else {
            return;
        };
        let [released, pressed] = words;
        let word = if contact.is_pressed { pressed } else { released };
        self.input.store(image, word.load::<6>(image));
    }

    fn publish_load(&self, values: &load::Snapshot, image: &mut [u8]) {
        self.load_state.store(image, [values.is_broken.into()]);
        // A sample from before the last reference must not bring the old load back.
        if values.offset.to_le_bytes() == self.load_offset.load(image) {
            self.load.store(image, values.load.to_le_bytes());
            self.signals.store(image, [values.signals]);
            self.measured_load.store(image, values.measured.to_le_bytes());
        }
    }

    /// Does what a new virtual output says. To be called after every frame that may have brought one: the next may be for
    /// another panel.
    pub(crate) fn follow_output(&self, followers: &mut [Lamp; LAMPS], image: &mut [u8]) {
        let output = self.output.load(image);
        for ((follower, words), lamp) in followers.iter_mut().zip(&self.lamp_words).zip(&self.lamps) {
            let [off, on] = words.map(|at| at.load(image));
            if let Some(is_lit) = follower.follow(output, on, off) {
                lamp.store(image, [is_lit.into()]);
            }
        }
    }

    /// Which lamps are lit.
    pub(crate) fn lit(&self, image: &[u8]) -> [bool; LAMPS] {
        self.lamps.map(|lamp| lamp.u8(image) != 0)
    }

    /// The parameters in the image. A value that no write could have put there acts as the smallest.
    pub(crate) fn parameters(&self, image: &[u8]) -> Parameters {
        Parameters { position: self.position_parameters(image), load: self.load_parameters(image) }
    }

    pub(super) fn position_parameters(&self, image: &[u8]) -> position::Parameters {
        let mut sensors = self.sensors.parameters(image);
        for (channel, references) in sensors.channels.iter_mut().zip(&self.references) {
            channel.references = references.u8(image);
        }
        position::Parameters {
            sensors,
            travel: NonZeroU32::new(self.travel.u32(image)).unwrap_or(NonZeroU32::MIN),
            position_step: NonZeroU16::new(self.position_step.u16(image)).unwrap_or(NonZeroU16::MIN),
            speed_step: NonZeroU16::new(self.speed_step.u16(image)).unwrap_or(NonZeroU16::MIN),
            units: self.units.each_ref().map(|unit| unit.parameters(image)),
        }
    }

    pub(super) fn load_parameters(&self, image: &[u8]) -> load::Parameters {
        let point =
            |[pressure, load]: [Field; 2]| Point { pressure: pressure.f32(image), load: load.f32(image) };
        load::Parameters {
            transducer: self.transducer.calibration(image),
            filter_type: self.filter_type.u8(image),
            filter_constant: self.filter_constant.u8(image),
            points: self.points.map(point),
            offset: self.load_offset.f32(image),
            limits: self.limits.map(|at| at.u16(image)),
        }
    }

    /// Fills in what follows from the parameters: the device type.
    pub(crate) fn initialise(&self, image: &mut [u8]) {
        self.device_type.store(image, self.device_type(image).to_le_bytes());
    }

    /// Device type (1000h): the virtual device that this one is, or 0 in bits 24 to 31 for several in one.
    pub(super) fn device_type(&self, image: &[u8]) -> u32 {
        let is_used = |all: &[[Field; 2]]| all.iter().any(|words| differ(*words, image));
        let has = [
            (INPUT_PANEL, is_used(&self.buttons)),
            (OUTPUT_PANEL, is_used(&self.lamp_words)),
            (POSITION_UNIT, self.units.iter().any(|unit| unit.source.u8(image) != 0)),
            (LOAD_UNIT, self.load_parameters(image).is_calibrated()),
        ];
        let mut codes = has.into_iter().filter(|(_, is_there)| *is_there).map(|(code, _)| code);
        let code = match (codes.next(), codes.next()) {
            (Some(code), None) => code,
            _ => 0,
        };
        code << 24 | PROFILE
    }
}

/// Two sub-indexes in a row.
const fn pair(d: &Dictionary, index: u16, first: u8) -> [Field; 2] {
    [d.field(index, first), d.field(index, first + 1)]
}

fn differ([a, b]: [Field; 2], image: &[u8]) -> bool {
    a.get(image) != b.get(image)
}

/// The number of the profile, and codes of virtual devices in object 1000h.
pub(super) const PROFILE: u32 = 417;
const INPUT_PANEL: u32 = 0x02;
const OUTPUT_PANEL: u32 = 0x03;
const POSITION_UNIT: u32 = 0x06;
const LOAD_UNIT: u32 = 0x0A;

fn integer(field: Field, image: &[u8]) -> i32 {
    i32::from_le_bytes(field.load(image))
}
