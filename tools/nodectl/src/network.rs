//! The bus as the services above it use it: wait for one frame without losing the others, open it again.

use std::collections::VecDeque;

use canopen::{Duration, Frame, Instant};

use crate::bus::{Bus, BusError, Received};

/// Frames that are kept for later; the oldest go first.
const KEPT: usize = 4096;

/// A bus that can be opened again when it is lost.
pub struct Network {
    opener: Box<dyn FnMut() -> Result<Box<dyn Bus>, BusError>>,
    bus: Box<dyn Bus>,
    kept: VecDeque<Received>,
    /// Time stamp of the newest frame and when it arrived.
    newest: Option<(Instant, Instant)>,
}

impl Network {
    /// Goes on the bus that `opener` opens, now and whenever [`reopen`](Network::reopen) is called.
    ///
    /// # Errors
    /// Those of `opener`.
    pub fn open(
        mut opener: impl FnMut() -> Result<Box<dyn Bus>, BusError> + 'static,
    ) -> Result<Network, BusError> {
        let bus = opener()?;
        Ok(Network { opener: Box::new(opener), bus, kept: VecDeque::new(), newest: None })
    }

    /// Opens the bus anew. What is kept of the old one is dropped.
    ///
    /// # Errors
    /// Those of the opener; the network is as it was.
    pub fn reopen(&mut self) -> Result<(), BusError> {
        self.bus = (self.opener)()?;
        self.kept.clear();
        self.newest = None;
        Ok(())
    }

    /// The time of this side.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    /// The time on the bus by the clock of the adapter: the newest time stamp and what has passed since. `None` before
    /// the first frame.
    #[must_use]
    pub fn bus_time(&self) -> Option<Instant> {
        self.newest.map(|(at, arrival)| at + Duration(self.now().0.saturating_sub(arrival.0)))
    }

    /// Sends a frame.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    /// The next frame; `None` when there was none until then. First come those that [`wait`](Network::wait) passed over.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        match self.kept.pop_front() {
            Some(received) => Ok(Some(received)),
            None => self.fetch(until),
        }
    }

    /// Forgets the frames that were passed over.
    pub fn forget(&mut self) {
        self.kept.clear();
    }

    /// The first frame from now on that `pick` takes; `None` when there was none until then. The others are kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn wait<T>(
        &mut self,
        until: Instant,
        mut pick: impl FnMut(&Frame) -> Option<T>,
    ) -> Result<Option<T>, BusError> {
        while let Some(received) = self.fetch(until)? {
            if let Some(picked) = pick(&received.frame) {
                return Ok(Some(picked));
            }
            if self.kept.len() == KEPT {
                self.kept.pop_front();
            }
            self.kept.push_back(received);
            // A busy bus must not hold up the deadline.
            if self.now() >= until {
                break;
            }
        }
        Ok(None)
    }

    /// Lets time pass; what arrives is kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn pause(&mut self, time: Duration) -> Result<(), BusError> {
        let until = self.now() + time;
        self.wait(until, |_| None::<()>).map(drop)
    }

    fn fetch(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        let received = self.bus.receive(until)?;
        if let Some(received) = received {
            self.newest = Some((received.at, self.bus.now()));
        }
        Ok(received)
    }
}
