//! A generator of foreign traffic, up to a full bus.

use fastrand::Rng;

use crate::{
    Attachment, BitTiming, Controller, ErrorReport, ExtendedId, Frame, StandardId, Time, frame_bits,
};

/// Sends frames of random content, one after the other, at a chosen share of the bus.
///
/// At a load of 1 a frame is always ready, so the bus is never idle. The identifiers decide which nodes are delayed.
#[derive(Clone, Debug)]
pub struct Babbler {
    bit: Time,
    load: f64,
    identifiers: Vec<embedded_can::Id>,
    bytes: Option<usize>,
    rng: Rng,
    frame: Frame,
    due: Time,
    sent: u64,
}

impl Babbler {
    /// Base identifiers that no node of a CANopen network with nodes 1 to 127 uses: 780h to 7E3h.
    pub fn foreign() -> Vec<embedded_can::Id> {
        (0x780..0x7E4).filter_map(StandardId::new).map(embedded_can::Id::from).collect()
    }

    /// Extended identifiers of any value, none of which CANopen uses.
    pub fn extended(count: usize, seed: u64) -> Vec<embedded_can::Id> {
        let mut rng = Rng::with_seed(seed);
        (0..count).filter_map(|_| ExtendedId::new(rng.u32(..1 << 29))).map(embedded_can::Id::from).collect()
    }

    /// A generator with bits of this length that takes the share `load` (0 to 1) of the bus with frames whose
    /// identifiers are drawn from `identifiers`. The same seed gives the same traffic.
    ///
    /// # Panics
    /// Without an identifier, or with a load of zero or less.
    pub fn new(bit: Time, load: f64, identifiers: Vec<embedded_can::Id>, seed: u64) -> Babbler {
        assert!(!identifiers.is_empty() && load > 0.0);
        let mut rng = Rng::with_seed(seed);
        let frame = draw(&mut rng, &identifiers, None);
        Babbler { bit, load, identifiers, bytes: None, rng, frame, due: Time::ZERO, sent: 0 }
    }

    /// Fixes the number of data bytes, 0 to 8; otherwise the number is random.
    #[must_use]
    pub fn with_bytes(mut self, bytes: usize) -> Babbler {
        self.bytes = Some(bytes.min(8));
        self.frame = draw(&mut self.rng, &self.identifiers, self.bytes);
        self
    }

    /// Frames sent.
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// The span between the starts of two frames that makes the load.
    fn period(&self) -> Time {
        Time(((self.bit * frame_bits(&self.frame)).0 as f64 / self.load) as u64)
    }
}

fn draw(rng: &mut Rng, identifiers: &[embedded_can::Id], bytes: Option<usize>) -> Frame {
    let mut data = [0; 8];
    rng.fill(&mut data);
    let id = identifiers[rng.usize(..identifiers.len())];
    let len = bytes.unwrap_or_else(|| rng.usize(..=8));
    Frame::data(id, &data[..len]).expect("at most eight bytes")
}

/// The babbler repeats failed frames and ignores error confinement, so that a test has its load under all conditions.
impl Controller for Babbler {
    fn attachment(&mut self, _at: Time) -> Attachment {
        Attachment::Active { timing: BitTiming::nominal(self.bit) }
    }

    fn requested(&self) -> Option<Time> {
        Some(self.due)
    }

    fn pending(&mut self, _at: Time) -> Option<Frame> {
        Some(self.frame)
    }

    fn start_of_frame(&mut self, _transmitting: bool, _at: Time) {}

    fn lost(&mut self, _at: Time) {}

    fn sent(&mut self, at: Time) {
        let begun = at.since(self.bit * (frame_bits(&self.frame) - 3));
        // When the bus has delayed the frame, the babbler does not catch up.
        self.due = begun + self.period();
        self.frame = draw(&mut self.rng, &self.identifiers, self.bytes);
        self.sent += 1;
    }

    fn received(&mut self, _frame: &Frame, _at: Time) {}

    fn error(&mut self, _report: &ErrorReport, _at: Time) {}

    fn idle(&mut self, _since: Time) {}
}
