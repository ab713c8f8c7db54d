//! Calibration, 2200h to 2204h: manufacturer-specific objects that are written and then locked in production.
//!
//! For the formulas see [`PressureCalibration`] and [`Thermistor`]. A write needs the key in 2203h, else it is refused
//! with 0800 0022h. A value that would make the calibration invalid is refused with 0604 0043h. Written values act from
//! the next sample on, and are stored when 2204h gets "save". 1010h and 1011h do not affect them.

use crate::pressure::{
    Calibration, Polynomial, PressureCalibration, TemperatureCalibration, Thermistor, Thermometer,
};
use canopen::dictionary::{Access, Dictionary, Entry, Field, Group, Object, Type};
use canopen::sdo::Abort;

/// The rules for these objects.
#[derive(Clone, Copy)]
pub(crate) enum Rule {
    /// 2200h and 2201h: a value of the calibration.
    Value,
    /// 2202h: a record about the calibration.
    Record,
    /// 2203h: the lock of the other objects.
    Lock,
}

impl Rule {
    /// The rule of an object.
    pub(crate) const fn of(index: u16, sub: u8) -> Option<Rule> {
        match (index, sub) {
            (0x2200 | 0x2201, 1..) => Some(Rule::Value),
            (0x2202, 1..) => Some(Rule::Record),
            (0x2203, 0) => Some(Rule::Lock),
            _ => None,
        }
    }
}

/// The value of 2203h that opens the lock until the node is reset: "cali". 0 closes the lock.
const KEY: [u8; 4] = *b"cali";

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Calibration).handled()
}

const fn real(index: u16, sub: u8, name: &'static str, default: f32) -> Object {
    parameter(index, sub, name, Type::Real32).real(default)
}

const fn command(index: u16, name: &'static str) -> Object {
    Object::new(index, 0, name, Type::Unsigned32, Access::ReadWrite)
}

pub(crate) const CALIBRATION: &[Object] = &[
    Object::highest(0x2200, 11, "Pressure calibration"),
    real(0x2200, 1, "Pressure at start of range", 0.0).unit("Pa"),
    real(0x2200, 2, "Pressure at end of range", 1_000_000.0).unit("Pa"),
    real(0x2200, 3, "Zero ratio", 0.1),
    real(0x2200, 4, "Zero linear coefficient", 0.0).unit("1/K"),
    real(0x2200, 5, "Zero quadratic coefficient", 0.0).unit("1/K2"),
    real(0x2200, 6, "Span ratio", 0.8),
    real(0x2200, 7, "Span linear coefficient", 0.0).unit("1/K"),
    real(0x2200, 8, "Span quadratic coefficient", 0.0).unit("1/K2"),
    real(0x2200, 9, "Reference temperature", 298.15).unit("K"),
    real(0x2200, 10, "Lowest ratio of an intact sensor", 0.025),
    real(0x2200, 11, "Highest ratio of an intact sensor", 0.975),
    Object::highest(0x2201, 9, "Temperature calibration"),
    // 0: the sensor of the chip, 1: the thermistor.
    parameter(0x2201, 1, "Thermometer", Type::Unsigned8).limits(0, 1),
    real(0x2201, 2, "Temperature factor", 1.0),
    real(0x2201, 3, "Temperature offset", 0.0).unit("K"),
    // 10 kohm at 25 degC, beta 3950 K.
    real(0x2201, 4, "Thermistor coefficient A", 0.001_022_29).unit("1/K"),
    real(0x2201, 5, "Thermistor coefficient B", 0.000_253_164_55).unit("1/K"),
    real(0x2201, 6, "Thermistor coefficient C", 0.0).unit("1/K"),
    real(0x2201, 7, "Resistor of the thermistor", 10_000.0).unit("ohm"),
    real(0x2201, 8, "Lowest ratio of an intact thermistor", 0.01),
    real(0x2201, 9, "Highest ratio of an intact thermistor", 0.99),
    Object::highest(0x2202, 2, "Calibration record"),
    parameter(0x2202, 1, "Number of calibrations", Type::Unsigned32),
    // Decimal digits of year, month and day: 20251231. 0 for a device that was not calibrated.
    parameter(0x2202, 2, "Date of calibration", Type::Unsigned32).limits(0, 99_991_231),
    command(0x2203, "Calibration lock").handled(),
    command(0x2204, "Save calibration").stores_calibration().value(1),
];

/// The places of the values.
#[derive(Debug)]
pub(crate) struct Places {
    pressure: [Field; 11],
    thermometer: Field,
    temperature: [Field; 8],
    lock: Field,
}

impl Places {
    pub(crate) const fn new(d: &Dictionary) -> Places {
        Places {
            pressure: fields(d, 0x2200, 1),
            thermometer: d.field(0x2201, 1),
            temperature: fields(d, 0x2201, 2),
            lock: d.field(0x2203, 0),
        }
    }

    /// The places of start and end of the range.
    pub(crate) fn range(&self) -> [Field; 2] {
        let [start, end, ..] = self.pressure;
        [start, end]
    }

    /// The calibration in the image. An impossible calibration acts as the default one.
    pub(crate) fn calibration(&self, image: &[u8]) -> Calibration {
        Some(self.load(image)).filter(Calibration::is_valid).unwrap_or_default()
    }

    fn load(&self, image: &[u8]) -> Calibration {
        let [start, end, z0, z1, z2, s0, s1, s2, reference, break_low, break_high] =
            self.pressure.map(|field| field.f32(image));
        let [factor, offset, a, b, c, series, lowest, highest] =
            self.temperature.map(|field| field.f32(image));
        let [zero, span] = [(z0, z1, z2), (s0, s1, s2)].map(|(constant, linear, quadratic)| Polynomial {
            constant,
            linear,
            quadratic,
        });
        let thermometer = match self.thermometer.u8(image) {
            0 => Thermometer::Internal,
            _ => Thermometer::Thermistor,
        };
        let thermistor = Thermistor { a, b, c, series, break_low: lowest, break_high: highest };
        Calibration {
            pressure: PressureCalibration { start, end, zero, span, reference, break_low, break_high },
            temperature: TemperatureCalibration { thermometer, factor, offset, thermistor },
        }
    }

    /// Tries the value, and restores the image: the device stores an admitted value.
    fn admits(&self, field: Field, bytes: &[u8], image: &mut [u8]) -> bool {
        // A value shorter than four bytes is followed by other values, which are restored too.
        let before: [u8; 4] = field.load(image);
        field.set(image, bytes);
        let is_valid = self.load(image).is_valid();
        field.store(image, before);
        is_valid
    }

    /// Checks a write to an object that has one of the rules above.
    pub(crate) fn write(
        &self,
        rule: Rule,
        entry: &Entry,
        bytes: &[u8],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        match rule {
            Rule::Lock if bytes == KEY || bytes == [0; 4] => Ok(()),
            Rule::Lock => Err(Abort::NotStored),
            Rule::Value | Rule::Record if self.lock.load(image) != KEY => Err(Abort::DeviceState),
            Rule::Value if !self.admits(entry.field(), bytes, image) => Err(Abort::Parameter),
            Rule::Value | Rule::Record => Ok(()),
        }
    }
}

/// The places of `N` values, starting at a sub-index.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
const fn fields<const N: usize>(d: &Dictionary, index: u16, first: u8) -> [Field; N] {
    let mut fields = [d.field(index, first); N];
    let mut i: u8 = 0;
    while (i as usize) < N {
        fields[i as usize] = d.field(index, first + i);
        i += 1;
    }
    fields
}
