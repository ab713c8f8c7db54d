//! A bus that a test can inspect, disturb and break while a client uses it.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use canopen::{Duration, Frame, Instant, NodeId, QueueFull, Transmit};
use nodectl::Network;
use nodectl::bus::{Bus, BusError, Received, Simulated, Station};
use nodectl::sdo::{Client, Options};

/// The fate of each frame.
type Fault = Box<dyn FnMut(&Frame) -> Fate>;

/// The fate of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    Arrives,
    IsLost,
    BecomesAnother(Frame),
    /// The client's connection to the bus breaks at this frame.
    BreaksTheBus,
}

/// The frames of a device, in a queue that is never full.
#[derive(Default)]
pub(crate) struct Answers(pub(crate) Vec<Frame>);

impl Transmit for Answers {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

struct State<S> {
    bus: Simulated<S>,
    fault: Fault,
    broken: bool,
}

/// A simulated bus. Clones share the bus.
pub(crate) struct Wire<S>(Rc<RefCell<State<S>>>);

impl<S> Clone for Wire<S> {
    fn clone(&self) -> Wire<S> {
        Wire(Rc::clone(&self.0))
    }
}

impl<S: Station + 'static> Wire<S> {
    pub(crate) fn new(station: S) -> Wire<S> {
        let fault = Box::new(|_: &Frame| Fate::Arrives);
        Wire(Rc::new(RefCell::new(State { bus: Simulated::new(station), fault, broken: false })))
    }

    /// Sets the fate of the frames in both directions.
    pub(crate) fn disturb(&self, fault: impl FnMut(&Frame) -> Fate + 'static) {
        self.0.borrow_mut().fault = Box::new(fault);
    }

    /// Every `n`th frame is lost.
    pub(crate) fn lose_every(&self, n: usize) {
        let mut count = 0;
        self.disturb(move |_| {
            count += 1;
            if count % n == 0 { Fate::IsLost } else { Fate::Arrives }
        });
    }

    /// Gives access to the station.
    pub(crate) fn station<T>(&self, look: impl FnOnce(&mut S) -> T) -> T {
        look(&mut self.0.borrow_mut().bus.station)
    }

    /// A client's connection to the bus. Opening it again repairs the connection.
    pub(crate) fn network(&self) -> Network {
        let this = self.clone();
        Network::open(move || {
            this.0.borrow_mut().broken = false;
            Ok(Box::new(this.clone()))
        })
        .expect("an open bus")
    }

    /// A client's connection to the bus that cannot be opened again at once: a second passes with each of so many tries.
    pub(crate) fn network_back_after(&self, tries: usize) -> Network {
        let (this, mut tries) = (self.clone(), tries);
        Network::open(move || {
            let mut state = this.0.borrow_mut();
            if state.broken && tries > 0 {
                tries -= 1;
                let until = state.bus.now() + Duration::from_millis(1000);
                while state.bus.now() < until {
                    state.bus.receive(until)?;
                }
                return Err(BusError::Lost(io::Error::other("unplugged")));
            }
            state.broken = false;
            drop(state);
            Ok(Box::new(this.clone()))
        })
        .expect("an open bus")
    }
}

impl<S: Station> State<S> {
    fn fate(&mut self, frame: &Frame) -> Result<Fate, BusError> {
        let fate = (self.fault)(frame);
        self.broken |= fate == Fate::BreaksTheBus;
        self.check().map(|()| fate)
    }

    fn check(&self) -> Result<(), BusError> {
        if self.broken { Err(BusError::Lost(io::Error::other("unplugged"))) } else { Ok(()) }
    }
}

impl<S: Station> Bus for Wire<S> {
    fn now(&self) -> Instant {
        self.0.borrow().bus.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let mut state = self.0.borrow_mut();
        match state.fate(frame)? {
            Fate::Arrives => state.bus.send(frame),
            Fate::BecomesAnother(frame) => state.bus.send(&frame),
            _ => Ok(()),
        }
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        let mut state = self.0.borrow_mut();
        state.check()?;
        while let Some(received) = state.bus.receive(until)? {
            match state.fate(&received.frame)? {
                Fate::Arrives => return Ok(Some(received)),
                Fate::BecomesAnother(frame) => return Ok(Some(Received { frame, ..received })),
                _ => (),
            }
        }
        Ok(None)
    }
}

/// A client with the usual time-out for an answer, and with a long time limit for a transfer.
pub(crate) fn client(network: &mut Network, node: u8) -> Client<'_> {
    let (timeout, limit) = (Duration::from_millis(500), Duration::from_millis(60_000));
    let options = Options { timeout, limit, ..Options::default() };
    Client::new(network, NodeId::new(node).expect("a node-ID"), options)
}
