//! A device behind a layer that adds one fault.

use canopen::nmt::State;
use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;
use nodectl::check::Profile;

use super::device::{ID, Whole};

/// The event that the layer sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// A frame is on its way to the device.
    In,
    /// A frame of the device is on its way to the bus.
    Out,
    /// Ten milliseconds have passed.
    Tick,
}

/// The input and the output of the layer.
pub(super) struct Look {
    pub(super) way: Way,
    pub(super) frame: Frame,
    pub(super) state: State,
    pub(super) now: Instant,
    /// The frame that the layer passes on; `None` if the frame is lost.
    pub(super) pass: Option<Frame>,
    /// Additional frames to the bus. They come after a frame of the device, and before the answer to a frame to the
    /// device.
    pub(super) to_bus: Vec<Frame>,
    /// Additional frames to the device, after the frame that the layer passes on.
    pub(super) to_device: Vec<Frame>,
    /// Frames to the bus after this number of milliseconds.
    pub(super) later: Vec<(u64, Frame)>,
    /// Whether the stored parameters are cleared.
    pub(super) forgets: bool,
}

impl Look {
    /// The data of the frame, where the frame is a request to the SDO server.
    pub(super) fn request(&self) -> Option<[u8; 8]> {
        self.data(Way::In, 0x600 + u16::from(ID))
    }

    /// The data of the frame, where the frame is a response of the SDO server.
    pub(super) fn response(&self) -> Option<[u8; 8]> {
        self.data(Way::Out, 0x580 + u16::from(ID))
    }

    fn data(&self, way: Way, id: u16) -> Option<[u8; 8]> {
        let is_it = self.way == way && self.frame.id() == id && !self.frame.is_remote();
        self.frame.data().try_into().ok().filter(|_| is_it)
    }

    /// Whether the frame is a data frame with this CAN-ID in this direction.
    pub(super) fn is(&self, way: Way, id: u16) -> bool {
        self.way == way && self.frame.id() == id && !self.frame.is_remote()
    }

    /// Answers the request instead of the device.
    pub(super) fn answer(&mut self, data: [u8; 8]) {
        self.pass = None;
        self.to_bus.push(frame(0x580 + u16::from(ID), &data));
    }

    /// Replaces the data of the frame.
    pub(super) fn replace(&mut self, data: &[u8]) {
        self.pass = Some(frame(self.frame.id(), data));
    }
}

/// A frame.
pub(super) fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(id, data).expect("a frame")
}

/// A layer that adds a fault.
pub(super) type Layer = Box<dyn FnMut(&mut Look)>;

/// The device behind the layer.
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

    /// Passes frames to the device, and its answers to the bus.
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
