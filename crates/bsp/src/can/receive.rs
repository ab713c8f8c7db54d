//! A receive FIFO, and the queue into which its interrupt moves the frames.

use canopen::{Frame, Instant};
use heapless::spsc::{Consumer, Producer, Queue};

use crate::can::controller::registers;
use crate::can::filters::Fifo;
use crate::can::mailbox::Mailbox;
use crate::losses::{Event, Losses};
use crate::time::time_base::Clock;

/// Number of frames that can wait for their task. The shortest frame takes 47 us at 1 Mbit/s, so the queue holds 1.5 ms
/// of the densest traffic.
const CAPACITY: usize = 32;

/// Number of polls for a mailbox to be released, 100 us at least. The slowest known chip takes 17 us.
const RELEASE_POLLS: u32 = 2_000;

/// The queue between the interrupt and the task.
pub type ReceiveQueue<const N: usize = CAPACITY> = Queue<Received, N>;

/// A frame with the time of its interrupt.
#[derive(Clone, Copy, Debug)]
pub struct Received {
    /// The frame.
    pub frame: Frame,
    /// The time stamp.
    pub at: Instant,
}

/// The interrupt's side of one FIFO.
pub struct Receiver {
    fifo: Fifo,
    queue: Producer<'static, Received>,
    lost: &'static Losses,
}

/// The task's side of one FIFO.
pub type Frames = Consumer<'static, Received>;

impl Receiver {
    /// Both sides of a FIFO.
    pub fn new<const N: usize>(
        fifo: Fifo,
        queue: &'static mut ReceiveQueue<N>,
        lost: &'static Losses,
    ) -> (Receiver, Frames) {
        let (producer, consumer) = queue.split();
        (Receiver { fifo, queue: producer, lost }, consumer)
    }

    /// Moves all frames from the FIFO into the queue. The three places of the FIFO fill in 141 us at 1 Mbit/s. A frame
    /// for which the FIFO or the queue has no room is counted ([`Event::Frame`]).
    pub fn drain(&mut self) {
        let at = Clock::now();
        // Never true, but the type of the queue does not guarantee it, and a queue without places would divide by zero.
        if self.queue.capacity() == usize::MAX {
            return;
        }
        while let Some(mailbox) = self.next() {
            if let Some(frame) = mailbox.frame() {
                let full = self.queue.enqueue(Received { frame, at }).is_err();
                self.count(full);
            }
        }
    }

    fn next(&mut self) -> Option<Mailbox> {
        let state = registers().rfr(self.fifo as usize);
        let now = state.read();
        if now.fovr().bit_is_set() {
            state.write(|w| w.fovr().clear());
            self.count(true);
        }
        if now.fmp().bits() > 0 { self.release() } else { None }
    }

    /// Reads the oldest frame and releases its place. A place that is not released is counted, and its frame is read again
    /// by the next interrupt; a FIFO that never releases one ends in a reset by the watchdog.
    fn release(&mut self) -> Option<Mailbox> {
        let oldest = take(self.fifo);
        if oldest.is_none() {
            self.count(true);
        }
        oldest
    }

    fn count(&self, lost: bool) {
        if lost {
            self.lost.count(Event::Frame);
        }
    }
}

/// Reads the frame at the output of a FIFO and releases its place; `None` where the FIFO does not release it.
#[inline]
pub(crate) fn take(fifo: Fifo) -> Option<Mailbox> {
    let output = registers().rx(fifo as usize);
    let mailbox = Mailbox {
        rir: output.rir().read().bits(),
        rdtr: output.rdtr().read().bits(),
        rdlr: output.rdlr().read().bits(),
        rdhr: output.rdhr().read().bits(),
    };
    registers().rfr(fifo as usize).write(|w| w.rfom().set_bit());
    // The next frame is at the output once the hardware has cleared the request, a few clocks later.
    let is_released = (0..RELEASE_POLLS).any(|_| registers().rfr(fifo as usize).read().rfom().bit_is_clear());
    is_released.then_some(mailbox)
}
