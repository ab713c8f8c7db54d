//! How a node that is not sure of the bit rate joins a bus: as a guest that disturbs no frames of others.
//!
//! | state | on the bus | ends with |
//! |---|---|---|
//! | trying | yes, at a stored rate; no frame received yet | a received frame: staying; the first error: searching |
//! | searching | listens, one rate after the other | a received frame: staying, at its rate |
//! | resting | listens at 250 kbit/s | a received frame: staying; an error and no frame soon after: searching |
//! | staying | yes | never |
//!
//! A guest without a stored rate sends nothing before another node does: a bus may be silent because its nodes wait. A
//! sender without an acknowledge repeats the frame and soon becomes error passive; from then on the guest
//! receives the frame too.

use canopen::{Duration, Instant};

use crate::can::bit_timing::BitTiming;
use crate::can::bus_state::Heard;
use crate::policy::bit_rate_detection::{Detector, Step};

/// The rate at which a node without a bit rate waits on a silent bus (as in CMP 8271).
const ASSUMED: BitTiming = BitTiming::at(250);
/// Time for which the frame of a single sender may look like an error: after 16 attempts of 135 bits and an error flag
/// at 250 kbit/s the sender is error passive.
const ATTEMPTS: Duration = Duration::from_millis(12);

/// The guest with its state.
#[derive(Debug)]
pub struct Guest(State);

#[derive(Debug)]
enum State {
    Trying,
    Searching(Detector),
    /// With the time of the first error.
    Resting(Option<Instant>),
    Staying,
}

impl Guest {
    /// A guest that begins at a stored rate ([`Step::Found`]), or listens ([`Step::Listen`]); the caller carries out
    /// the step.
    #[must_use]
    pub fn new(stored: Option<BitTiming>) -> (Guest, Step) {
        match stored {
            Some(timing) => (Guest(State::Trying), Step::Found(timing)),
            None => (Guest(State::Resting(None)), Step::Listen(ASSUMED)),
        }
    }

    /// A guest that searches until it receives a frame, even on a silent bus (automatic detection). Searching means
    /// listening only.
    #[must_use]
    pub fn searching(now: Instant) -> (Guest, Step) {
        let (state, step) = search(now);
        (Guest(state), step)
    }

    /// Whether the guest only listens.
    #[must_use]
    pub fn is_listening(&self) -> bool {
        matches!(self.0, State::Searching(_) | State::Resting(_))
    }

    /// Whether the guest has received a frame and stays at its rate.
    #[must_use]
    pub fn is_staying(&self) -> bool {
        matches!(self.0, State::Staying)
    }

    /// Takes the events since the last step. The result: continue, listen at a rate, or go on the bus
    /// ([`Step::Found`]).
    pub fn step(&mut self, heard: Heard, now: Instant) -> Step {
        let (state, step) = match (&mut self.0, heard) {
            (State::Staying, _)
            | (State::Trying | State::Resting(None), Heard::Silence)
            | (State::Trying, Heard::Nobody) => return Step::Stay,
            (State::Trying, Heard::Frame) => (State::Staying, Step::Stay),
            (State::Resting(_), Heard::Frame) => (State::Staying, Step::Found(ASSUMED)),
            (State::Resting(None), _) => (State::Resting(Some(now)), Step::Stay),
            (State::Resting(Some(since)), _) if now < *since + ATTEMPTS => return Step::Stay,
            (State::Trying, Heard::Error) | (State::Resting(_), _) => search(now),
            (State::Searching(detector), heard) => match detector.step(heard, now) {
                Step::Found(timing) => (State::Staying, Step::Found(timing)),
                step => return step,
            },
        };
        self.0 = state;
        step
    }
}

fn search(now: Instant) -> (State, Step) {
    let detector = Detector::new(now);
    let timing = detector.timing();
    (State::Searching(detector), Step::Listen(timing))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Instant = Instant(0);
    const LATER: Instant = Instant(2_000_000);

    fn at(kbit: u16) -> BitTiming {
        BitTiming::of(kbit).unwrap()
    }

    fn with(stored: Option<u16>) -> Guest {
        Guest::new(stored.map(at)).0
    }

    #[test]
    fn a_stored_rate_is_used_at_once_and_holds_with_the_first_frame() {
        let (mut guest, step) = Guest::new(Some(at(500)));
        assert_eq!(step, Step::Found(at(500)));
        assert_eq!(guest.step(Heard::Silence, LATER), Step::Stay);
        assert_eq!(guest.step(Heard::Nobody, LATER), Step::Stay, "nobody is there yet");
        assert!(!guest.is_staying() && !guest.is_listening());
        assert_eq!(guest.step(Heard::Frame, LATER), Step::Stay);
        assert!(guest.is_staying());
        assert_eq!(guest.step(Heard::Error, LATER), Step::Stay);
    }

    #[test]
    fn a_stored_rate_that_does_not_fit_is_left_with_the_first_error() {
        let mut guest = with(Some(500));
        assert_eq!(guest.step(Heard::Error, NOW), Step::Listen(at(250)));
        assert!(guest.is_listening());
        assert_eq!(guest.step(Heard::Error, NOW), Step::Listen(at(500)));
        assert_eq!(guest.step(Heard::Error, NOW), Step::Listen(at(125)));
        assert_eq!(guest.step(Heard::Frame, NOW), Step::Found(at(125)));
        assert!(guest.is_staying());
    }

    #[test]
    fn without_a_stored_rate_the_guest_listens_at_250_kbit() {
        let (mut guest, step) = Guest::new(None);
        assert_eq!(step, Step::Listen(at(250)));
        for seconds in 0..1_000 {
            assert_eq!(guest.step(Heard::Silence, Instant(seconds * 1_000_000)), Step::Stay);
            assert!(guest.is_listening());
        }
        assert_eq!(guest.step(Heard::Frame, LATER), Step::Found(at(250)));
        assert!(guest.is_staying());
    }

    #[test]
    fn a_lone_master_is_received_after_it_is_error_passive() {
        let mut guest = with(None);
        for millis in 0..10 {
            assert_eq!(guest.step(Heard::Error, Instant(millis * 1_000)), Step::Stay);
        }
        assert_eq!(guest.step(Heard::Frame, Instant(10_000)), Step::Found(at(250)));
    }

    #[test]
    fn a_bus_at_another_rate_is_found_from_rest() {
        let mut guest = with(None);
        assert_eq!(guest.step(Heard::Error, NOW), Step::Stay);
        assert_eq!(guest.step(Heard::Silence, Instant(11_000)), Step::Stay);
        assert_eq!(guest.step(Heard::Silence, Instant(12_000)), Step::Listen(at(250)));
        assert_eq!(guest.step(Heard::Error, NOW), Step::Listen(at(500)));
        assert_eq!(guest.step(Heard::Frame, NOW), Step::Found(at(500)));
    }

    #[test]
    fn a_search_that_was_asked_for_never_speaks_and_never_rests() {
        let (mut guest, step) = Guest::searching(NOW);
        assert_eq!(step, Step::Listen(at(250)));
        for i in 0..10_000_u64 {
            let step = guest.step(Heard::Silence, Instant(i * 10_000));
            assert!(!matches!(step, Step::Found(_)));
            assert!(matches!(guest.0, State::Searching(_)));
        }
        assert!(matches!(guest.step(Heard::Frame, Instant(100_000_000)), Step::Found(_)));
    }
}
