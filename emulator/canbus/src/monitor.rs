//! Watches for sequences of recessive bits: one to join the bus, 128 to come back from bus-off.

use crate::Time;

/// Recessive bits in a row that tell that the bus is idle.
const SEQUENCE_BITS: u64 = 11;

/// A controller's view of when the wire is recessive, and what it waits for.
#[derive(Clone, Copy, Debug)]
pub struct Monitor {
    recessive: Option<Time>,
    wait: Option<Wait>,
    /// When the last wait ended.
    ended: Time,
}

#[derive(Clone, Copy, Debug)]
struct Wait {
    /// Sequences still to be seen.
    sequences: u64,
    /// No bit before this counts.
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

    /// On a wire that is recessive since power-on; waits for nothing.
    pub fn new() -> Monitor {
        Monitor { recessive: Some(Time::ZERO), wait: None, ended: Time::ZERO }
    }

    /// Whether it waits.
    pub fn is_waiting(&self) -> bool {
        self.wait.is_some()
    }

    /// Whether a frame is on the wire.
    pub fn is_busy(&self) -> bool {
        self.recessive.is_none()
    }

    /// Begins to wait for that many sequences, counted from `now`.
    pub fn wait(&mut self, sequences: u64, now: Time) {
        self.wait = Some(Wait { sequences, from: now });
    }

    /// Waits no longer.
    pub fn cancel(&mut self) {
        self.wait = None;
    }

    /// The wire has been recessive since `since`.
    pub fn idle(&mut self, since: Time) {
        self.recessive = Some(since);
    }

    /// A frame begins: the sequences that end here count, the incomplete one is lost.
    pub fn busy(&mut self, at: Time, bit: Time) {
        if let (Some(wait), Some(recessive)) = (&mut self.wait, self.recessive) {
            let seen = at.since(recessive.max(wait.from)).0 / (bit * SEQUENCE_BITS).0.max(1);
            wait.sequences = wait.sequences.saturating_sub(seen);
        }
        self.recessive = None;
    }

    /// When the wait ends if the wire stays as it is; `Time::NEVER` while it is busy or without a wait.
    pub fn due(&self, bit: Time) -> Time {
        match (self.wait, self.recessive) {
            (Some(wait), Some(recessive)) => {
                recessive.max(wait.from) + bit * (SEQUENCE_BITS * wait.sequences)
            }
            _ => Time::NEVER,
        }
    }

    /// When the controller may take part: the end of the wait, or of the last one. It begins no frame before it.
    pub fn ready(&self, bit: Time) -> Time {
        if self.is_waiting() { self.due(bit) } else { self.ended }
    }

    /// Whether the wait has ended by `now`; then it is over.
    pub fn poll(&mut self, now: Time, bit: Time) -> bool {
        let due = self.due(bit);
        let done = due <= now && due != Time::NEVER;
        if done {
            (self.wait, self.ended) = (None, due);
        }
        done
    }
}
