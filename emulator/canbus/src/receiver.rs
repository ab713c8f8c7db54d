//! The receiving half of a CAN controller: levels in, frames or errors out (ISO 11898-1:2015, 10.4 to 10.6).

use crate::bits::{BitString, DOMINANT, END_OF_FRAME_BITS, Level, RECESSIVE, STUFF_RUN, crc_end, decode};
use crate::{BusError, Frame};

/// The meaning of a bit for the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// The frame continues.
    Nothing,
    /// The next bit is the ACK slot; with `true` the receiver acknowledges.
    AckSlotNext(bool),
    /// The frame is valid; one bit of its end is left.
    Valid(Frame),
    /// The last bit of the frame, of this level.
    End(Level),
    /// The frame is faulty.
    Error(BusError),
}

/// Decodes a frame from the bits on the wire, one bit at a time.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    bits: BitString,
    last: Level,
    run: u8,
    /// Bits after the CRC sequence, once it is complete.
    tail: Option<usize>,
}

impl Receiver {
    /// A receiver that waits for the start of frame.
    pub(crate) fn new() -> Receiver {
        Receiver { bits: BitString::default(), last: RECESSIVE, run: 0, tail: None }
    }

    /// Whether the receiver has seen a start of frame.
    pub(crate) fn is_inside(&self) -> bool {
        self.bits.len > 0
    }

    /// Takes the next bit.
    pub(crate) fn feed(&mut self, level: Level) -> Seen {
        if let Some(n) = self.tail {
            self.tail = Some(n + 1);
            return self.feed_tail(n, level);
        }
        if !self.is_inside() && level == RECESSIVE {
            return Seen::Nothing;
        }
        let stuffed = self.run == STUFF_RUN;
        self.run = if level == self.last { self.run + 1 } else { 1 };
        self.last = level;
        if self.run > STUFF_RUN {
            return Seen::Error(BusError::Stuff);
        }
        if !stuffed {
            self.bits.push(u32::from(level), 1);
        }
        // A run of five that ends the CRC sequence is still followed by its stuff bit.
        if self.run < STUFF_RUN && crc_end(&self.bits) == Some(self.bits.len) {
            self.tail = Some(0);
        }
        Seen::Nothing
    }

    /// CRC delimiter, ACK slot, ACK delimiter, end of frame.
    fn feed_tail(&mut self, n: usize, level: Level) -> Seen {
        const LAST: usize = 2 + END_OF_FRAME_BITS;
        match (n, level) {
            (1, _) => Seen::Nothing,
            (LAST, _) => Seen::End(level),
            (_, DOMINANT) => Seen::Error(BusError::Form),
            (0, _) => Seen::AckSlotNext(self.intact()),
            // The flag of a CRC error follows the ACK delimiter (ISO 11898-1:2015, 10.11).
            (2, _) if !self.intact() => Seen::Error(BusError::Crc),
            (n, _) if n == LAST - 1 => self.valid(),
            _ => Seen::Nothing,
        }
    }

    fn valid(&self) -> Seen {
        decode(&self.bits).map_or(Seen::Error(BusError::Form), Seen::Valid)
    }

    fn intact(&self) -> bool {
        self.bits.crc() == 0
    }
}
