//! A bus on which the frames of the client wait in its adapter, behind the more urgent frames of other nodes.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use canopen::{Duration, Frame, Instant};
use nodectl::Network;
use nodectl::bus::{Bus, BusError, Received, Station};
use nodectl::object::at;

use crate::loader::Loader;
use crate::wire::{Answers, client};

/// The load of the bus by more urgent frames: the bus is full for a while, and then free for a while.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// The time of one frame.
    frame: Duration,
    full: Duration,
    free: Duration,
}

struct Line {
    station: Loader,
    load: Load,
    now: Instant,
    adapter: VecDeque<Frame>,
    answers: Answers,
}

#[derive(Clone)]
struct Slow(Rc<RefCell<Line>>);

impl Slow {
    /// A loader without a program, which accepts a new program at once.
    fn new(load: Load) -> Slow {
        let (station, now, adapter) = (Loader::new(3, &[]), Instant(0), VecDeque::new());
        Slow(Rc::new(RefCell::new(Line { station, load, now, adapter, answers: Answers::default() })))
    }

    fn network(&self) -> Network {
        let this = self.clone();
        Network::open(move || Ok(Box::new(this.clone()))).expect("an open bus")
    }
}

impl Line {
    fn is_full(&self) -> bool {
        let Load { full, free, .. } = self.load;
        self.now.0 % (full.0 + free.0) < full.0
    }

    /// Lets the next frame pass: the answers of the node are more urgent than the requests to it.
    fn step(&mut self, until: Instant) -> Option<Frame> {
        let due = self.station.poll(self.now, &mut self.answers);
        let end = self.now + self.load.frame;
        if !self.answers.0.is_empty() {
            self.now = end;
            return Some(self.answers.0.remove(0));
        }
        if self.adapter.is_empty() {
            self.now = due.max(self.now + Duration(1)).min(until);
            return None;
        }
        let is_full = self.is_full();
        self.now = end;
        if let Some(frame) = self.adapter.pop_front_if(|_| !is_full) {
            self.station.receive(&frame, self.now, &mut self.answers);
        }
        None
    }
}

impl Bus for Slow {
    fn now(&self) -> Instant {
        self.0.borrow().now
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.0.borrow_mut().adapter.push_back(*frame);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        let mut line = self.0.borrow_mut();
        while line.now < until {
            if let Some(frame) = line.step(until) {
                return Ok(Some(Received { frame, at: line.now }));
            }
        }
        Ok(None)
    }
}

/// A server that hears nothing for a while acknowledges a part of a block whose other segments still wait.
#[test]
fn a_block_whose_segments_wait_for_urgent_frames_arrives_once() {
    // Two block downloads at once: the less urgent one waits for the time of a block of the other one.
    let two_updates = [(120, 16), (950, 120), (2400, 305), (5900, 750)]
        .map(|(frame, full)| (frame, full, 40 * frame / 1000));
    let urgent = [(120, 450, 450), (120, 900, 300), (950, 900, 300), (950, 350, 100), (2400, 900, 900)];
    for (frame, full, free) in two_updates.into_iter().chain(urgent) {
        let load = Load {
            frame: Duration(frame),
            full: Duration::from_millis(full),
            free: Duration::from_millis(free),
        };
        let slow = Slow::new(load);
        let mut network = slow.network();
        let value: Vec<u8> = (0..3000).map(|byte| (byte * 7 % 251) as u8).collect();
        let result = client(&mut network, 3).block_download(at(0x1F50, 1), &value, |_| ());
        assert!(result.is_ok(), "{load:?}: {result:?}");
        assert!(slow.0.borrow_mut().station.flash().program == value, "{load:?}");
    }
}
