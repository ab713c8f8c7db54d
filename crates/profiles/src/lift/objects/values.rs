//! Transfer of measured values into the image, and of parameters out of the image.

use super::choice::Choice;
use super::panel::PanelFields;
use crate::encoder::Area;
use crate::encoder::objects::Sensors;
use crate::lift::devices::Devices;
use crate::lift::load::{self, Point};
use crate::lift::position::{self, AREA, NO_OFFSET, Source, UNITS, UnitParameters, UnitValues};
use crate::lift::{Parameters, Snapshot};
use crate::pressure::objects::Places;
use canopen::dictionary::{Dictionary, Field};
use core::num::{NonZeroU16, NonZeroU32};

/// The places of the lift's values in the image of its dictionary.
#[derive(Debug)]
pub struct Fields {
    pub(super) choice: Choice,
    pub(super) panel: PanelFields,
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
    hysteresis: Field,
    points: [[Field; 2]; 2],
    pub(super) load_offset: Field,
    pub(super) measured_load: Field,
    pub(super) load_state: Field,
}

/// The places of one position unit's values.
#[derive(Debug)]
pub(super) struct UnitFields {
    pub(super) source: Field,
    pub(super) offset: Field,
    pub(super) state: Field,
    /// Number of presets: see [`UnitParameters::references`].
    pub(super) references: Field,
    pub(super) operating: Field,
    pub(super) position: Field,
    pub(super) reading: Field,
    speed: Field,
    area: Field,
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
            references: d.field(0x2306, sub),
            operating: d.field(0x6380, sub),
            position: d.field(0x6383, sub),
            reading: d.field(0x2304, sub),
            speed: d.field(0x6390, sub),
            area: d.field(0x63AF + sub as u16, 1),
            limits: [d.field(0x63B3 + sub as u16, 1), d.field(0x63B7 + sub as u16, 1)],
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
            references: self.references.u8(image),
        }
    }

    /// The offset has lost its meaning. A unit that has never been preset has none.
    #[inline(never)]
    pub(super) fn drop_offset(&self, image: &mut [u8]) {
        self.offset.store(image, [0; 4]);
        if self.references.u8(image) != 0 {
            self.references.store(image, [NO_OFFSET]);
        }
    }

    fn publish(&self, values: &UnitValues, image: &mut [u8]) {
        self.speed.store(image, values.speed.to_le_bytes());
        self.operating_status.store(image, values.operating_status.to_le_bytes());
        self.resolution.store(image, values.resolution.to_le_bytes());
        self.revolutions.store(image, values.revolutions.to_le_bytes());
        self.warnings.store(image, values.warnings.to_le_bytes());
        // A sample from before the last preset must not restore the old position.
        if values.offset == integer(self.offset, image) {
            self.position.store(image, values.position.to_le_bytes());
            self.reading.store(image, values.reading.to_le_bytes());
            self.state.store(image, [values.state]);
            self.area.store(image, [values.state & AREA]);
        }
    }
}

impl Fields {
    /// Looks the fields up during compilation.
    pub(crate) const fn new(d: &Dictionary) -> Fields {
        Fields {
            choice: Choice::new(d),
            panel: PanelFields::new(d),
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
            hysteresis: d.field(0x2310, 3),
            points: [pair(d, 0x2311, 1), pair(d, 0x2311, 3)],
            load_offset: d.field(0x2312, 0),
            measured_load: d.field(0x2313, 1),
            load_state: d.field(0x2313, 2),
        }
    }

    /// Copies a snapshot into the image.
    pub(crate) fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        for (unit, values) in self.units.iter().zip(&snapshot.position.units) {
            unit.publish(values, image);
        }
        self.publish_load(&snapshot.load, image);
    }

    fn publish_load(&self, values: &load::Snapshot, image: &mut [u8]) {
        self.load_state.store(image, [values.is_broken.into()]);
        // A sample from before the last reference must not restore the old load.
        if values.offset.to_le_bytes() == self.load_offset.load(image) {
            self.load.store(image, values.load.to_le_bytes());
            self.signals.store(image, [values.signals]);
            self.measured_load.store(image, values.measured.to_le_bytes());
        }
    }

    /// The parameters in the image. An impossible value acts as the smallest possible one.
    pub(crate) fn parameters(&self, image: &[u8]) -> Parameters {
        Parameters {
            position: self.position_parameters(image),
            load: self.load_parameters(image),
            devices: self.devices(image),
        }
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
            hysteresis: self.hysteresis.u16(image),
        }
    }

    /// Fills in the objects that depend on the choice of virtual devices. The TPDOs of virtual devices that are not
    /// chosen are switched off, whatever is stored.
    pub(crate) fn initialise(&self, image: &mut [u8]) {
        self.choose(self.devices(image), false, image);
    }

    /// The virtual devices that are chosen.
    pub(super) fn devices(&self, image: &[u8]) -> Devices {
        self.choice.devices(image)
    }
}

/// Two consecutive sub-indexes.
pub(super) const fn pair(d: &Dictionary, index: u16, first: u8) -> [Field; 2] {
    [d.field(index, first), d.field(index, first + 1)]
}

fn integer(field: Field, image: &[u8]) -> i32 {
    i32::from_le_bytes(field.load(image))
}
