//! The driver of our devices, and a received frame.

use core::hint::black_box;

use bench_images::{Bits, transmit};
use canopen::{Frame, QueueFull, Transmit};

/// A queue of which the optimiser knows nothing.
pub(crate) struct Driver {
    room: usize,
}

impl Driver {
    pub(crate) fn new() -> Driver {
        Driver { room: black_box(usize::MAX) }
    }
}

impl Transmit for Driver {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if transmit(&frame, bits) { Ok(()) } else { Err(QueueFull) }
    }

    fn room(&self) -> usize {
        self.room
    }
}

fn bits(frame: &Frame) -> Bits {
    let mut data = [0; 8];
    for (to, from) in data.iter_mut().zip(frame.data()) {
        *to = *from;
    }
    Bits { id: frame.id(), len: frame.len(), data }
}

/// A received frame.
pub(crate) struct Received(pub(crate) Frame);

impl From<Bits> for Received {
    fn from(bits: Bits) -> Received {
        let data = bits.data.get(..bits.len).unwrap_or(&[]);
        Received(Frame::new(bits.id, data).expect("the host sends valid frames"))
    }
}
