//! What the bus asks of everything that is wired to it.

use crate::{BitTiming, Frame, Time};

/// How a controller takes part in the traffic at a given moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attachment {
    /// Not on the bus: in initialisation, asleep, without power, synchronising, or bus-off.
    Off,
    /// Hears everything, sends and acknowledges nothing (silent mode).
    Silent {
        /// Its bit.
        timing: BitTiming,
    },
    /// Takes part; its error flags destroy a frame that it sees as faulty.
    Active {
        /// Its bit.
        timing: BitTiming,
    },
    /// Takes part, but signals errors only recessively.
    Passive {
        /// Its bit.
        timing: BitTiming,
    },
}

impl Attachment {
    /// Its bit; `None` off the bus.
    pub fn timing(self) -> Option<BitTiming> {
        match self {
            Attachment::Off => None,
            Attachment::Silent { timing }
            | Attachment::Active { timing }
            | Attachment::Passive { timing } => Some(timing),
        }
    }

    /// The same with another bit.
    pub(crate) fn with(self, timing: BitTiming) -> Attachment {
        match self {
            Attachment::Off => Attachment::Off,
            Attachment::Silent { .. } => Attachment::Silent { timing },
            Attachment::Active { .. } => Attachment::Active { timing },
            Attachment::Passive { .. } => Attachment::Passive { timing },
        }
    }

    /// Whether it may send.
    pub(crate) fn can_send(self) -> bool {
        matches!(self, Attachment::Active { .. } | Attachment::Passive { .. })
    }
}

/// Errors as ISO 11898-1 names them and the LEC field of bxCAN counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BusError {
    /// Six equal bits in a row.
    Stuff,
    /// A fixed-form bit has the wrong level.
    Form,
    /// Nobody acknowledged.
    Ack,
    /// A recessive bit was read back dominant.
    BitRecessive,
    /// A dominant bit was read back recessive.
    BitDominant,
    /// The checksum does not match.
    Crc,
}

/// What one participant saw of an error on the wire. `Confinement` makes TEC and REC of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorReport {
    /// What it detected first.
    pub error: BusError,
    /// Whether it was sending the frame.
    pub transmitting: bool,
    /// Dominant bits that it saw while it sent a passive error flag.
    pub dominant_in_flag: u16,
    /// Dominant bits in a row that it saw right after its error flag: others' flags.
    pub dominant_after_flag: u16,
}

/// A CAN controller as the bus sees it: a bxCAN peripheral, a node in this process, or a network client.
///
/// The bus calls these in the order of virtual time. `at` is the instant of the event on the wire, which for
/// `start_of_frame` may lie up to one quantum of the co-simulation before what the participant has already done
/// (see the crate documentation).
pub trait Controller {
    /// How it takes part at `at`.
    fn attachment(&mut self, at: Time) -> Attachment;

    /// The earliest instant at which it wants to begin a frame, as far as it knows now; `None` without a request.
    /// The bus begins none of its frames before it.
    fn requested(&self) -> Option<Time>;

    /// The frame that wins inside this controller at `at`; `None` when nothing was requested up to `at`.
    fn pending(&mut self, at: Time) -> Option<Frame>;

    /// A frame begins on the wire; with `transmitting` it is the one that `pending` gave.
    fn start_of_frame(&mut self, transmitting: bool, at: Time);

    /// Its frame lost the arbitration; it goes on as a receiver.
    fn lost(&mut self, at: Time);

    /// Its frame was sent and acknowledged; `at` is the end of frame.
    fn sent(&mut self, at: Time);

    /// A frame of somebody else's is valid: `at` is the last but one bit of the end of frame.
    fn received(&mut self, frame: &Frame, at: Time);

    /// An error destroyed the frame on the wire; `at` is the end of the last error flag that this participant saw.
    fn error(&mut self, report: &ErrorReport, at: Time);

    /// The wire has been recessive since `since` and remains so until the next `start_of_frame`.
    fn idle(&mut self, since: Time);
}
