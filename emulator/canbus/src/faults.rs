//! Bit errors that a test puts on the wire.

use fastrand::Rng;

/// The position of a bit in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// The number of the bit, counted with stuff bits; the start of frame is 0.
    Bit(usize),
    /// The ACK slot.
    AckSlot,
    /// The last bit of the end of frame. The receivers have already accepted the frame: a transmitter that reads this
    /// bit dominant repeats the frame, as ISO 11898-1 allows, and the receivers get it twice.
    LastBit,
}

impl Position {
    /// The number of the bit in a frame of `bits` bits without intermission.
    fn resolve(self, bits: usize) -> usize {
        match self {
            Position::Bit(n) => n,
            Position::AckSlot => bits.saturating_sub(9),
            Position::LastBit => bits.saturating_sub(1),
        }
    }
}

/// The participants that read the bit inverted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenBy {
    /// All participants.
    Everyone,
    /// All participants that began the frame.
    Transmitters,
    /// One participant, by its place in the slice that `Bus::step` gets.
    Participant(usize),
}

/// A bit error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The number of the frame on this bus: every attempt counts, the first is 0.
    pub frame: u64,
    /// The bit.
    pub position: Position,
    /// The participants that read the bit inverted.
    pub seen_by: SeenBy,
}

/// A bit of the current frame that is read inverted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flip {
    pub(crate) bit: usize,
    pub(crate) seen_by: SeenBy,
}

/// The bit errors of a bus: scheduled ones and random ones.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    scheduled: Vec<Fault>,
    noise: Option<(Rng, f64)>,
}

impl Faults {
    /// Adds one bit error.
    pub fn schedule(&mut self, fault: Fault) {
        self.scheduled.push(fault);
    }

    /// From now on, with this probability (0 to 1), every participant reads one random bit of a frame inverted. The
    /// same seed gives the same errors.
    pub fn noise(&mut self, seed: u64, probability: f64) {
        self.noise = Some((Rng::with_seed(seed), probability));
    }

    /// Ends the random errors.
    pub fn quiet(&mut self) {
        self.noise = None;
    }

    /// The errors of frame number `frame` that is `bits` bits long.
    pub(crate) fn of_frame(&mut self, frame: u64, bits: usize) -> Vec<Flip> {
        let due = self.scheduled.extract_if(.., |fault| fault.frame == frame);
        let mut flips: Vec<Flip> =
            due.map(|fault| Flip { bit: fault.position.resolve(bits), seen_by: fault.seen_by }).collect();
        if let Some((rng, probability)) = &mut self.noise
            && rng.f64() < *probability
        {
            flips.push(Flip { bit: rng.usize(..bits), seen_by: SeenBy::Everyone });
        }
        flips
    }
}
