//! Watches for sequences of recessive bits: one sequence to join the bus, 128 to recover from bus-off.

use crate::Time;

/// Recessive bits in a row that mean an idle bus.
const SEQUENCE_BITS: u64 = 11;

/// A controller's view of the wire: since when the wire is recessive, and the wait for recessive sequences.
#[derive(Clone, Copy, Debug)]
pub struct Monitor {
    recessive: Option<Time>,
    wait: Option<Wait>,
    /// The instant at which the last wait ended.
    ended: Time,
}

#[derive(Clone, Copy, Debug)]
struct Wait {
    /// Sequences still to be seen.
    sequences: u64,
    /// Bits before this instant do not count.
    from: Time,
}

impl Default for Monitor {
    fn default() -> Monitor {
        Monitor::new()
    }
}

impl Monitor {
    /// Sequences of eleven recessive bits that end the bus-off state (ISO 11898-1:2015, 12.1.4.4).
    pub const BUS_OFF_SEQUENCES: u64 = 128;

    /// A monitor of a wire that is recessive since power-on, without a wait.
    pub fn new() -> Monitor {
        Monitor { recessive: Some(Time::ZERO), wait: None, ended: Time::ZERO }
    }

    /// Whether a wait is under way.
    pub fn is_waiting(&self) -> bool {
        self.wait.is_some()
    }

    /// Whether a frame is on the wire.
    pub fn is_busy(&self) -> bool {
        self.recessive.is_none()
    }

    /// Begins a wait for `sequences` sequences, counted from `now`.
    pub fn wait(&mut self, sequences: u64, now: Time) {
        self.wait = Some(Wait { sequences, from: now });
    }

    /// Ends the wait.
    pub fn cancel(&mut self) {
        self.wait = None;
    }

    /// The wire has been recessive since `since`.
    pub fn idle(&mut self, since: Time) {
        self.recessive = Some(since);
    }

    /// A frame begins: the complete sequences before it count, an incomplete one does not.
    pub fn busy(&mut self, at: Time, bit: Time) {
        if let (Some(wait), Some(recessive)) = (&mut self.wait, self.recessive) {
            let seen = at.since(recessive.max(wait.from)).0 / (bit * SEQUENCE_BITS).0.max(1);
            wait.sequences = wait.sequences.saturating_sub(seen);
        }
        self.recessive = None;
    }

    /// The instant at which the wait ends if no frame begins; `Time::NEVER` during a frame or without a wait.
    pub fn due(&self, bit: Time) -> Time {
        match (self.wait, self.recessive) {
            (Some(wait), Some(recessive)) => {
                recessive.max(wait.from) + bit * (SEQUENCE_BITS * wait.sequences)
            }
            _ => Time::NEVER,
        }
    }

    /// The instant from which on the controller may begin a frame: the end of the current or of the last wait.
    pub fn ready(&self, bit: Time) -> Time {
        if self.is_waiting() { self.due(bit) } else { self.ended }
    }

    /// Whether the wait has ended by `now`; if so, the wait is removed.
    pub fn poll(&mut self, now: Time, bit: Time) -> bool {
        let due = self.due(bit);
        let done = due <= now && due != Time::NEVER;
        if done {
            (self.wait, self.ended) = (None, due);
        }
        done
    }
}
