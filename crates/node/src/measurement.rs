//! The sampling half: one raw sample in, one snapshot out, a thousand times a second.

use crate::Personality;
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

/// The measurement chains of a personality and their state.
#[derive(Clone, Debug)]
pub struct Measurement {
    chains: Chains,
    /// Before there are parameters, nothing is measured.
    has_parameters: bool,
}

/// In one place: a node is either of them.
#[derive(Clone, Debug)]
enum Chains {
    Sensors { pressure: Option<Transmitter>, encoder: Option<Encoder> },
    Lift(Lift),
}

impl Measurement {
    /// A measurement after power-on, with what was kept of the position sensors.
    #[must_use]
    pub fn new(personality: Personality, start: Start) -> Measurement {
        let sensors = |pressure, encoder| Chains::Sensors { pressure, encoder };
        let transmitter = Transmitter::default;
        let chains = match personality {
            Personality::Pressure => sensors(Some(transmitter()), None),
            Personality::Encoder => sensors(None, Some(Encoder::new(start))),
            Personality::Combined => sensors(Some(transmitter()), Some(Encoder::new(start))),
            Personality::Lift => Chains::Lift(Lift::new(start)),
        };
        Measurement { chains, has_parameters: false }
    }

    /// Takes over new parameters of its personality, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        self.has_parameters = true;
        match &mut self.chains {
            Chains::Sensors { pressure, encoder } => {
                if let (Some(pressure), Some(parameters)) = (pressure, &parameters.pressure) {
                    pressure.apply(parameters);
                }
                if let (Some(encoder), Some(parameters)) = (encoder, &parameters.encoder) {
                    encoder.apply(parameters);
                }
            }
            Chains::Lift(lift) => {
                if let Some(parameters) = &parameters.lift {
                    lift.apply(parameters);
                }
            }
        }
    }

    /// Processes the sums of one millisecond, what was read of the position sensors at its end, and which buttons are
    /// pressed, debounced.
    pub fn sample(&mut self, raw: &RawSample, encoder: &RawEncoder, buttons: [bool; BUTTONS]) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.update(raw, encoder, buttons, &mut snapshot);
        snapshot
    }

    /// The same, with the snapshot where it is to be; it is the last one.
    pub fn update(
        &mut self,
        raw: &RawSample,
        shaft: &RawEncoder,
        buttons: [bool; BUTTONS],
        snapshot: &mut Snapshot,
    ) {
        match &mut self.chains {
            _ if !self.has_parameters => {}
            Chains::Sensors { pressure, encoder } => {
                if let Some(pressure) = pressure {
                    pressure.update(raw, snapshot.pressure.get_or_insert_default());
                }
                if let Some(encoder) = encoder {
                    encoder.update(shaft, snapshot.encoder.get_or_insert_default());
                }
            }
            Chains::Lift(lift) => {
                let raw = RawLift { encoder: *shaft, pressure: *raw, buttons };
                snapshot.lift = Some(lift.sample(&raw));
            }
        }
    }

    /// What is to outlive a loss of power; `None` where no position is measured.
    #[must_use]
    pub fn kept(&self) -> Option<Kept> {
        match &self.chains {
            _ if !self.has_parameters => None,
            Chains::Sensors { encoder, .. } => encoder.as_ref().map(Encoder::kept),
            Chains::Lift(lift) => Some(lift.kept()),
        }
    }

    /// Hands on the same as it is to be stored: see [`Kept::to_words`]. Without a copy on the way, a thousand times a second.
    pub fn keep(&self, store: impl FnOnce(&[u32; Kept::WORDS])) {
        match &self.chains {
            _ if !self.has_parameters => {}
            Chains::Sensors { encoder: Some(encoder), .. } => store(&encoder.kept_words()),
            Chains::Sensors { encoder: None, .. } => {}
            Chains::Lift(lift) => store(&lift.kept().to_words()),
        }
    }
}
