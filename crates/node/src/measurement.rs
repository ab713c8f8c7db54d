//! The sampling half: one raw sample in, one snapshot out, a thousand times a second.

use profiles::encoder::{self, Encoder, Kept, RawEncoder, Start};
use profiles::pressure::{self, RawSample, Transmitter};

/// All parameters of the measurement, as one consistent set; `None` for what the personality does not measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Of the pressure and temperature channels.
    pub pressure: Option<pressure::Parameters>,
    /// Of the encoder.
    pub encoder: Option<encoder::Parameters>,
}

/// All measured values of one millisecond, as one consistent set; `None` for what is not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Of the pressure and temperature channels.
    pub pressure: Option<pressure::Snapshot>,
    /// Of the encoder.
    pub encoder: Option<encoder::Snapshot>,
}

impl Snapshot {
    pub(crate) fn is_empty(&self) -> bool {
        self.pressure.is_none() && self.encoder.is_none()
    }
}

/// The measurement chains and their state. Nothing is measured before there are parameters: they say what.
#[derive(Clone, Debug)]
pub struct Measurement {
    pressure: Transmitter,
    encoder: Encoder,
    has_pressure: bool,
    has_encoder: bool,
}

impl Measurement {
    /// A measurement after power-on, with what was kept of the encoder.
    #[must_use]
    pub fn new(start: Start) -> Measurement {
        Measurement {
            pressure: Transmitter::default(),
            encoder: Encoder::new(start),
            has_pressure: false,
            has_encoder: false,
        }
    }

    /// Takes over new parameters, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        let Parameters { pressure, encoder } = parameters;
        (self.has_pressure, self.has_encoder) = (pressure.is_some(), encoder.is_some());
        if let Some(pressure) = pressure {
            self.pressure.apply(pressure);
        }
        if let Some(encoder) = encoder {
            self.encoder.apply(encoder);
        }
    }

    /// Processes the sums of one millisecond, and what was read of the encoder at its end.
    pub fn sample(&mut self, raw: &RawSample, encoder: &RawEncoder) -> Snapshot {
        Snapshot {
            pressure: self.has_pressure.then(|| self.pressure.sample(raw)),
            encoder: self.has_encoder.then(|| self.encoder.sample(encoder)),
        }
    }

    /// What is to outlive a loss of power.
    #[must_use]
    pub fn kept(&self) -> Kept {
        self.encoder.kept()
    }
}
