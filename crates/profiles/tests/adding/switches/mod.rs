//! The profile that docs/extending.md adds: two switches that are counted, and two lamps. The whole profile is in this
//! folder.

mod rows;

use canopen::ErrorClass;
use canopen::dictionary::{Dictionary, Entry, Field, Object};
use canopen::sdo::Abort;
use profiles::board::{DIGITAL_INPUTS, DIGITAL_OUTPUTS, Inputs, Outputs, PowerOn};
use profiles::fault::Fault;
use profiles::profile::{Chain, Profile};

/// The rows, without the rows that all devices have.
pub(crate) const ROWS: &[&[Object]] = rows::ROWS;

/// The profile detects no faults.
pub(crate) const FAULTS: &[Fault] = &[];

/// Switches that count when they open instead of when they close (6002h): bit n for switch n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Parameters {
    polarity: u8,
    /// Number of times that the counters were set to zero.
    resets: u8,
}

/// States and counters of the switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Snapshot {
    state: u8,
    counts: [u16; DIGITAL_INPUTS],
}

/// The sampling half.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counters {
    parameters: Parameters,
    snapshot: Snapshot,
}

impl Chain for Counters {
    type Parameters = Parameters;
    type Snapshot = Snapshot;

    fn new(_: &PowerOn) -> Counters {
        Counters::default()
    }

    fn apply(&mut self, parameters: &Parameters) {
        if parameters.resets != self.parameters.resets {
            self.snapshot.counts = [0; DIGITAL_INPUTS];
        }
        self.parameters = *parameters;
    }

    fn update(&mut self, inputs: &Inputs, snapshot: &mut Snapshot) {
        let before = self.snapshot.state;
        let pressed = (0..).zip(inputs.digital).fold(0, |bits, (bit, on)| bits | u8::from(on) << bit);
        self.snapshot.state = pressed ^ self.parameters.polarity;
        let closed = self.snapshot.state & !before;
        for (bit, count) in (0..).zip(&mut self.snapshot.counts) {
            *count = count.wrapping_add(u16::from(closed >> bit & 1));
        }
        *snapshot = self.snapshot;
    }
}

/// The places of the values.
#[derive(Debug)]
pub(crate) struct Fields {
    state: Field,
    polarity: Field,
    counts: [Field; DIGITAL_INPUTS],
    resets: Field,
    at_sync: Field,
    lamps: Field,
    error_mode: Field,
    error_value: Field,
}

/// Looks the fields up during compilation.
pub(crate) const fn fields(d: &Dictionary) -> Fields {
    Fields {
        state: d.field(0x6000, 1),
        polarity: d.field(0x6002, 1),
        counts: [d.field(0x2400, 1), d.field(0x2400, 2)],
        resets: d.field(0x2402, 0),
        at_sync: d.field(0x2403, 0),
        lamps: d.field(0x6200, 1),
        error_mode: d.field(0x6206, 1),
        error_value: d.field(0x6207, 1),
    }
}

/// Whether the profile decides on a write to this object: 2401h sets the counters to zero.
pub(crate) const fn handles(index: u16, sub: u8) -> bool {
    matches!((index, sub), (0x2401, 0))
}

/// The protocol half.
#[derive(Debug)]
pub(crate) struct Objects {
    fields: &'static Fields,
}

impl Profile for Objects {
    type Chain = Counters;
    type Fields = Fields;

    fn new(fields: &'static Fields) -> Objects {
        Objects { fields }
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        Parameters { polarity: self.fields.polarity.u8(image), resets: self.fields.resets.u8(image) }
    }

    fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
        self.fields.state.store(image, [snapshot.state]);
        for (field, count) in self.fields.counts.iter().zip(snapshot.counts) {
            field.store(image, count.to_le_bytes());
        }
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles(index, sub)
    }

    fn write(&mut self, _: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if bytes != b"zero" {
            return Err(Abort::NotStored);
        }
        let resets = self.fields.resets.u8(image).wrapping_add(1);
        self.fields.resets.store(image, [resets]);
        Ok(())
    }

    fn synchronised(&mut self, _: Option<u8>, image: &mut [u8]) {
        let state = self.fields.state.u8(image);
        self.fields.at_sync.store(image, [state]);
    }

    /// The lamps that have an error mode take their error value (6206h and 6207h).
    fn error(&mut self, _: ErrorClass, image: &mut [u8]) {
        let (mode, value) = (self.fields.error_mode.u8(image), self.fields.error_value.u8(image));
        let lamps = self.fields.lamps.u8(image) & !mode | value & mode;
        self.fields.lamps.store(image, [lamps]);
    }

    fn outputs(&self, image: &[u8]) -> Outputs {
        let lamps = self.fields.lamps.u8(image);
        let mut digital = [false; DIGITAL_OUTPUTS];
        (0..).zip(&mut digital).for_each(|(bit, lamp)| *lamp = lamps >> bit & 1 == 1);
        Outputs { digital }
    }
}
