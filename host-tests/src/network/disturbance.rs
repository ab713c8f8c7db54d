//! Disturbances of a frame: a frame is destroyed and sent again, arrives twice, or is delayed.

use canbus::{Bus, Fault, Frame, HostNode, Position, SeenBy, StandardId, Time};
use fastrand::Rng;

/// Number of more urgent frames that delay all other frames, for some 2.5 ms at 1 Mbit/s.
const BURST: u32 = 20;
/// A bit at 1 Mbit/s: the bit rate of a disturbed bus.
const BIT: Time = Time::from_micros(1);
/// The identifier of the urgent frames; CANopen does not use it.
const URGENT: StandardId = StandardId::new(0x001).expect("11 bits");

/// The number of disturbances of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Frames destroyed by a bit error; the transmitter sends the frame again.
    pub destroyed: u32,
    /// Frames with a bit error in the last bit, which only the transmitter sees; the receivers get the frame twice.
    pub repeated: u32,
    /// Bursts of urgent traffic that delay the next frame.
    pub delayed: u32,
}

/// Draws the disturbance of every frame; the same seed gives the same disturbances.
#[derive(Debug)]
pub struct Disturbance {
    rng: Rng,
    percent: u32,
    /// Number of frames whose disturbance is drawn.
    drawn: u64,
    pub(super) burst: HostNode,
    tally: Tally,
}

impl Disturbance {
    /// Each kind of disturbance affects `percent` of the frames.
    #[must_use]
    pub fn new(seed: u64, percent: u32) -> Disturbance {
        let rng = Rng::with_seed(seed);
        Disturbance { rng, percent, drawn: 0, burst: HostNode::new(BIT), tally: Tally::default() }
    }

    pub(super) fn tally(&self) -> Tally {
        self.tally
    }

    /// Schedules the faults of the frames that can begin next. The participants of the bus are the stations and a
    /// master.
    pub(super) fn prepare(&mut self, bus: &mut Bus, stations: usize, now: Time) {
        while self.drawn <= bus.frames() {
            let fate = self.rng.u32(..100) / self.percent;
            match fate {
                0 => self.destroy(bus, stations),
                1 => self.repeat(bus),
                2 => self.delay(now),
                _ => (),
            }
            self.drawn += 1;
        }
    }

    fn destroy(&mut self, bus: &mut Bus, stations: usize) {
        let seen_by = match self.rng.u8(..3) {
            0 => SeenBy::Everyone,
            1 => SeenBy::Transmitters,
            _ => SeenBy::Participant(self.rng.usize(..=stations)),
        };
        // The shortest frame of eight bytes has 108 bits up to its ACK delimiter.
        let position = Position::Bit(self.rng.usize(1..100));
        bus.faults.schedule(Fault { frame: self.drawn, position, seen_by });
        self.tally.destroyed += 1;
    }

    fn repeat(&mut self, bus: &mut Bus) {
        let (position, seen_by) = (Position::LastBit, SeenBy::Transmitters);
        bus.faults.schedule(Fault { frame: self.drawn, position, seen_by });
        self.tally.repeated += 1;
    }

    fn delay(&mut self, now: Time) {
        let urgent = Frame::data(URGENT, &[0; 8]).expect("eight bytes");
        (0..BURST).for_each(|_| self.burst.send(urgent, now));
        self.tally.delayed += 1;
    }
}
