//! A bus in this process with its own time, for tests of this crate and of other programs.

use std::collections::VecDeque;

use canopen::{Duration, Frame, Instant, QueueFull, Transmit};

use super::{Bus, BusError, Received};

/// The time of a frame of eight bytes at 250 kbit/s: 111 bits and some stuffing.
const FRAME_TIME: Duration = Duration(464);

/// A node on a simulated bus. Time is an argument, as in the crate `canopen`.
pub trait Station {
    /// Takes a frame from the bus.
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit);

    /// Does the work that is due. Returns the instant of the next call, `Instant::NEVER` for none.
    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant;
}

/// Several stations of a kind.
impl<S: Station> Station for Vec<S> {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.iter_mut().for_each(|station| station.receive(frame, now, out));
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.iter_mut().map(|station| station.poll(now, out)).min().unwrap_or(Instant::NEVER)
    }
}

/// A station and this program on a bus of 250 kbit/s. Frames are sent in the order of the requests, and every frame
/// takes the same time. The stations of a `Vec` do not hear each other.
#[derive(Debug)]
pub struct Simulated<S> {
    /// The other side of the bus.
    pub station: S,
    now: Instant,
    /// Frames of the station that are not yet received.
    queue: VecDeque<Frame>,
}

impl<S: Station> Simulated<S> {
    /// A bus at time 0.
    pub fn new(station: S) -> Simulated<S> {
        Simulated { station, now: Instant(0), queue: VecDeque::new() }
    }

    /// Advances the time to an instant, or to the next frame.
    fn advance(&mut self, until: Instant) {
        let mut out = Out(&mut self.queue);
        while out.0.is_empty() && self.now < until {
            let due = self.station.poll(self.now, &mut out);
            if out.0.is_empty() {
                self.now = due.max(self.now + Duration(1)).min(until);
            }
        }
    }
}

struct Out<'a>(&'a mut VecDeque<Frame>);

impl Transmit for Out<'_> {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push_back(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

impl<S: Station> Bus for Simulated<S> {
    fn now(&self) -> Instant {
        self.now
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let mut out = Out(&mut self.queue);
        self.station.poll(self.now, &mut out);
        self.now = self.now + FRAME_TIME;
        self.station.receive(frame, self.now, &mut out);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        self.advance(until);
        let Some(frame) = self.queue.pop_front() else { return Ok(None) };
        self.now = self.now + FRAME_TIME;
        Ok(Some(Received { frame, at: self.now }))
    }
}
