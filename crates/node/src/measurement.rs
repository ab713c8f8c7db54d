//! The sampling half: one raw sample in, one snapshot out, a thousand times a second.

use profiles::encoder::{self, Encoder, Kept, RawEncoder, Start};
use profiles::lift::panel::BUTTONS;
use profiles::lift::{self, Lift, RawLift};
use profiles::pressure::{self, RawSample, Transmitter};

/// All parameters of the measurement, as one consistent set; `None` for what the personality does not measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Of the pressure and temperature channels.
    pub pressure: Option<pressure::Parameters>,
    /// Of the encoder.
    pub encoder: Option<encoder::Parameters>,
    /// Of the lift's units, which share the inputs of both.
    pub lift: Option<lift::Parameters>,
}

impl Parameters {
    /// What the sensors of positions are, where there are any.
    #[must_use]
    pub fn sensors(&self) -> Option<&encoder::Parameters> {
        self.encoder.as_ref().or(self.lift.as_ref().map(|lift| &lift.position.sensors))
    }
}

/// All measured values of one millisecond, as one consistent set; `None` for what is not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Of the pressure and temperature channels.
    pub pressure: Option<pressure::Snapshot>,
    /// Of the encoder.
    pub encoder: Option<encoder::Snapshot>,
    /// Of the lift's units.
    pub lift: Option<lift::Snapshot>,
}

impl Snapshot {
    pub(crate) fn is_empty(&self) -> bool {
        self.pressure.is_none() && self.encoder.is_none() && self.lift.is_none()
    }
}

/// The measurement chains and their state. Nothing is measured before there are parameters: they say what.
#[derive(Clone, Debug)]
pub struct Measurement {
    pressure: Transmitter,
    encoder: Encoder,
    lift: Lift,
    has_pressure: bool,
    has_encoder: bool,
    has_lift: bool,
}

impl Measurement {
    /// A measurement after power-on, with what was kept of the position sensors.
    #[must_use]
    pub fn new(start: Start) -> Measurement {
        Measurement {
            pressure: Transmitter::default(),
            encoder: Encoder::new(start),
            lift: Lift::new(start),
            has_pressure: false,
            has_encoder: false,
            has_lift: false,
        }
    }

    /// Takes over new parameters, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        let Parameters { pressure, encoder, lift } = parameters;
        (self.has_pressure, self.has_encoder, self.has_lift) =
            (pressure.is_some(), encoder.is_some(), lift.is_some());
        if let Some(pressure) = pressure {
            self.pressure.apply(pressure);
        }
        if let Some(encoder) = encoder {
            self.encoder.apply(encoder);
        }
        if let Some(lift) = lift {
            self.lift.apply(lift);
        }
    }

    /// Processes the sums of one millisecond, what was read of the position sensors at its end, and which buttons are
    /// pressed, debounced.
    pub fn sample(&mut self, raw: &RawSample, encoder: &RawEncoder, buttons: [bool; BUTTONS]) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.update(raw, encoder, buttons, &mut snapshot);
        snapshot
    }

    /// The same, with the snapshot where it is to be.
    pub fn update(
        &mut self,
        raw: &RawSample,
        encoder: &RawEncoder,
        buttons: [bool; BUTTONS],
        snapshot: &mut Snapshot,
    ) {
        if self.has_pressure {
            self.pressure.update(raw, snapshot.pressure.get_or_insert_default());
        } else {
            snapshot.pressure = None;
        }
        if self.has_encoder {
            self.encoder.update(encoder, snapshot.encoder.get_or_insert_default());
        } else {
            snapshot.encoder = None;
        }
        if self.has_lift {
            self.update_lift(&RawLift { encoder: *encoder, pressure: *raw, buttons }, snapshot);
        } else {
            snapshot.lift = None;
        }
    }

    /// Out of the way of the others.
    #[inline(never)]
    fn update_lift(&mut self, raw: &RawLift, snapshot: &mut Snapshot) {
        snapshot.lift = Some(self.lift.sample(raw));
    }

    /// What is to outlive a loss of power; `None` where no position is measured.
    #[must_use]
    pub fn kept(&self) -> Option<Kept> {
        match (self.has_encoder, self.has_lift) {
            (true, _) => Some(self.encoder.kept()),
            (_, true) => Some(self.lift.kept()),
            _ => None,
        }
    }

    /// Hands on the same as it is to be stored: see [`Kept::to_words`]. Without a copy on the way, a thousand times a second.
    pub fn keep(&self, store: impl FnOnce(&[u32; Kept::WORDS])) {
        match (self.has_encoder, self.has_lift) {
            (true, _) => store(&self.encoder.kept_words()),
            (_, true) => store(&self.lift.kept().to_words()),
            _ => {}
        }
    }
}
