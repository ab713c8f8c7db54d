//! Measured values into the image, parameters out of it.

use crate::encoder::Sensors;
use crate::pressure::Places;
use canopen::dictionary::{Dictionary, Field};
use core::num::{NonZeroU16, NonZeroU32};
use profiles::encoder::Area;
use profiles::lift::load::{self, Point};
use profiles::lift::panel::Lamp;
use profiles::lift::position::{self, Source, UNITS, UnitParameters, UnitValues};
use profiles::lift::{Parameters, Snapshot};

/// Where the lift's values are in the image of a dictionary that has its objects.
pub struct Fields {
    pub(super) sensors: Sensors,
    pub(super) transducer: Places,
    pub(super) units: [UnitFields; UNITS],
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
    /// The words while the button is released and while it is pressed.
    button: [Field; 2],
    /// The words that put the lamp out and that light it.
    lamp_words: [Field; 2],
    lamp: Field,
}

/// Where the values of one position unit are.
pub(super) struct UnitFields {
    pub(super) source: Field,
    pub(super) offset: Field,
    pub(super) state: Field,
    pub(super) operating: Field,
    pub(super) position: Field,
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
            self.state.store(image, [values.state]);
        }
    }
}

impl Fields {
    /// Looks them up.
    ///
    /// # Panics
    /// During compilation, when the dictionary does not have them all.
    #[must_use]
    pub const fn new(d: &Dictionary) -> Fields {
        Fields {
            sensors: Sensors::new(d),
            transducer: Places::new(d),
            units: [
                UnitFields::new(d, 1),
                UnitFields::new(d, 2),
                UnitFields::new(d, 3),
                UnitFields::new(d, 4),
            ],
            travel: d.field(0x2300, 0),
            position_step: d.field(0x6384, 1),
            speed_step: d.field(0x6384, 2),
            load: d.field(0x6480, 1),
            signals: d.field(0x6482, 1),
            limits: [d.field(0x6483, 1), d.field(0x6483, 2), d.field(0x6483, 3), d.field(0x6483, 4)],
            filter_type: d.field(0x2310, 1),
            filter_constant: d.field(0x2310, 2),
            points: [[d.field(0x2311, 1), d.field(0x2311, 2)], [d.field(0x2311, 3), d.field(0x2311, 4)]],
            load_offset: d.field(0x2312, 0),
            measured_load: d.field(0x2313, 1),
            load_state: d.field(0x2313, 2),
            input: d.field(0x6010, 0),
            output: d.field(0x6011, 0),
            button: [d.field(0x2320, 1), d.field(0x2320, 2)],
            lamp_words: [d.field(0x2321, 1), d.field(0x2321, 2)],
            lamp: d.field(0x2322, 0),
        }
    }

    /// Takes a snapshot into the image.
    pub fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        for (unit, values) in self.units.iter().zip(&snapshot.position.units) {
            unit.publish(values, image);
        }
        self.publish_load(&snapshot.load, image);
        let [released, pressed] = self.button;
        let word = if snapshot.is_pressed { pressed } else { released };
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
    pub fn follow_output(&self, lamp: &mut Lamp, image: &mut [u8]) {
        let [off, on] = self.lamp_words.map(|at| at.load(image));
        if let Some(is_lit) = lamp.follow(self.output.load(image), on, off) {
            self.lamp.store(image, [is_lit.into()]);
        }
    }

    /// Whether the lamp is lit.
    #[must_use]
    pub fn is_lit(&self, image: &[u8]) -> bool {
        self.lamp.u8(image) != 0
    }

    /// The parameters in the image. A value that no write could have put there acts as the smallest.
    #[must_use]
    pub fn parameters(&self, image: &[u8]) -> Parameters {
        Parameters { position: self.position_parameters(image), load: self.load_parameters(image) }
    }

    pub(super) fn position_parameters(&self, image: &[u8]) -> position::Parameters {
        position::Parameters {
            sensors: self.sensors.parameters(image),
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

    /// Device type (1000h): the virtual device that this one is, or 0 in bits 24 to 31 for several in one.
    #[must_use]
    pub fn device_type(&self, image: &[u8]) -> u32 {
        let differ = |[a, b]: [Field; 2]| a.get(image) != b.get(image);
        let has = [
            (INPUT_PANEL, differ(self.button)),
            (OUTPUT_PANEL, differ(self.lamp_words)),
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

/// The number of the profile, and codes of virtual devices in object 1000h.
const PROFILE: u32 = 417;
const INPUT_PANEL: u32 = 0x02;
const OUTPUT_PANEL: u32 = 0x03;
const POSITION_UNIT: u32 = 0x06;
const LOAD_UNIT: u32 = 0x0A;

fn integer(field: Field, image: &[u8]) -> i32 {
    i32::from_le_bytes(field.load(image))
}
