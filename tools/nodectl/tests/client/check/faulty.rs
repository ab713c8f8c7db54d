//! The device behind a layer that makes it wrong in one way.

use canopen::nmt::State;
use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;
use nodectl::check::Profile;

use super::device::{ID, Whole};

/// Where the layer looks at something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// A frame is on its way to the device.
    In,
    /// A frame of the device is on its way to the bus.
    Out,
    /// Ten milliseconds have passed.
    Tick,
}

/// What the layer looks at, and what it does.
pub(super) struct Look {
    pub(super) way: Way,
    pub(super) frame: Frame,
    pub(super) state: State,
    pub(super) now: Instant,
    /// The frame that goes on; `None` for none.
    pub(super) pass: Option<Frame>,
    /// Frames that go to the bus: after a frame of the device, before what follows from a frame to the device.
    pub(super) to_bus: Vec<Frame>,
    /// Frames that go to the device after it.
    pub(super) to_device: Vec<Frame>,
    /// Frames that go to the bus after so many milliseconds.
    pub(super) later: Vec<(u64, Frame)>,
    /// What is stored is forgotten.
    pub(super) forgets: bool,
}

impl Look {
    /// The request to the SDO server, where it is one.
    pub(super) fn request(&self) -> Option<[u8; 8]> {
        self.data(Way::In, 0x600 + u16::from(ID))
    }

    /// The response of the SDO server, where it is one.
    pub(super) fn response(&self) -> Option<[u8; 8]> {
        self.data(Way::Out, 0x580 + u16::from(ID))
    }

    fn data(&self, way: Way, id: u16) -> Option<[u8; 8]> {
        let is_it = self.way == way && self.frame.id() == id && !self.frame.is_remote();
        self.frame.data().try_into().ok().filter(|_| is_it)
    }

    /// Whether it is a data frame with this CAN-ID, that way.
    pub(super) fn is(&self, way: Way, id: u16) -> bool {
        self.way == way && self.frame.id() == id && !self.frame.is_remote()
    }

    /// The layer answers instead of the device.
    pub(super) fn answer(&mut self, data: [u8; 8]) {
        self.pass = None;
        self.to_bus.push(frame(0x580 + u16::from(ID), &data));
    }

    /// Another frame goes on, with the same CAN-ID.
    pub(super) fn replace(&mut self, data: &[u8]) {
        self.pass = Some(frame(self.frame.id(), data));
    }
}

/// A frame.
pub(super) fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(id, data).expect("a frame")
}

/// What the layer does.
pub(super) type Layer = Box<dyn FnMut(&mut Look)>;

/// The device and the layer.
pub(super) struct Faulty {
    device: Whole,
    layer: Layer,
    later: Vec<(Instant, Frame)>,
    next_tick: Instant,
}

const TICK: Duration = Duration::from_millis(10);

impl Faulty {
    pub(super) fn new(profile: Option<Profile>, layer: Layer) -> Faulty {
        Faulty { device: Whole::new(profile), layer, later: Vec::new(), next_tick: Instant(0) + TICK }
    }

    /// The state of the device.
    pub(super) fn state(&self) -> State {
        self.device.state()
    }

    fn look(&mut self, way: Way, frame: Frame, now: Instant) -> Look {
        let pass = Some(frame);
        let state = self.device.state();
        let (to_bus, to_device, later) = (Vec::new(), Vec::new(), Vec::new());
        let mut look = Look { way, frame, state, now, pass, to_bus, to_device, later, forgets: false };
        (self.layer)(&mut look);
        self.later.extend(look.later.iter().map(|(ms, frame)| (now + Duration::from_millis(*ms), *frame)));
        if look.forgets {
            self.device.forget();
        }
        look
    }

    /// Hands frames to the device, and its frames to the bus.
    fn inject(&mut self, frames: &[Frame], now: Instant, out: &mut impl Transmit) {
        for frame in frames {
            self.device.receive(frame, now);
        }
        self.flush(now, out);
    }

    fn flush(&mut self, now: Instant, out: &mut impl Transmit) {
        for sent in self.device.take() {
            let look = self.look(Way::Out, sent, now);
            for frame in look.pass.into_iter().chain(look.to_bus) {
                out.send(frame).expect("room");
            }
            if !look.to_device.is_empty() {
                self.inject(&look.to_device, now, out);
            }
        }
    }
}

impl Station for Faulty {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let look = self.look(Way::In, *frame, now);
        let frames: Vec<Frame> = look.pass.into_iter().chain(look.to_device).collect();
        look.to_bus.into_iter().for_each(|frame| out.send(frame).expect("room"));
        self.inject(&frames, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let due = self.device.poll(now);
        self.flush(now, out);
        let is_due = |(at, _): &(Instant, Frame)| now >= *at;
        let (ready, waiting) = std::mem::take(&mut self.later).into_iter().partition(is_due);
        self.later = waiting;
        let ready: Vec<(Instant, Frame)> = ready;
        ready.into_iter().for_each(|(_, frame)| out.send(frame).expect("room"));
        if now >= self.next_tick {
            self.next_tick = now + TICK;
            let look = self.look(Way::Tick, frame(0, &[]), now);
            look.to_bus.into_iter().for_each(|frame| out.send(frame).expect("room"));
            self.inject(&look.to_device, now, out);
        }
        let later = self.later.iter().map(|(at, _)| *at).min().unwrap_or(Instant::NEVER);
        due.min(self.next_tick).min(later)
    }
}
