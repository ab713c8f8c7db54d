//! The interface between the bus and every participant.

use crate::{BitTiming, Frame, Time};

/// How a controller takes part in the traffic at a given moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attachment {
    /// Not on the bus: in initialisation, asleep, without power, synchronising, or bus-off.
    Off,
    /// Hears everything, but neither sends nor acknowledges (silent mode).
    Silent {
        /// The bit timing.
        timing: BitTiming,
    },
    /// Takes part in the traffic; the error flag destroys a frame in which this controller detects an error.
    Active {
        /// The bit timing.
        timing: BitTiming,
    },
    /// Takes part in the traffic, but sends only passive (recessive) error flags.
    Passive {
        /// The bit timing.
        timing: BitTiming,
    },
}

impl Attachment {
    /// The bit timing; `None` off the bus.
    pub fn timing(self) -> Option<BitTiming> {
        match self {
            Attachment::Off => None,
            Attachment::Silent { timing }
            | Attachment::Active { timing }
            | Attachment::Passive { timing } => Some(timing),
        }
    }

    /// The attachment with another bit timing.
    pub(crate) fn with(self, timing: BitTiming) -> Attachment {
        match self {
            Attachment::Off => Attachment::Off,
            Attachment::Silent { .. } => Attachment::Silent { timing },
            Attachment::Active { .. } => Attachment::Active { timing },
            Attachment::Passive { .. } => Attachment::Passive { timing },
        }
    }

    /// Whether the controller may send.
    pub(crate) fn can_send(self) -> bool {
        matches!(self, Attachment::Active { .. } | Attachment::Passive { .. })
    }
}

/// The errors of ISO 11898-1, in the order of the LEC field of bxCAN.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BusError {
    /// Six equal bits in a row.
    Stuff,
    /// A fixed-form bit has the wrong level.
    Form,
    /// No node acknowledged the frame.
    Ack,
    /// A recessive bit was read back dominant.
    BitRecessive,
    /// A dominant bit was read back recessive.
    BitDominant,
    /// The checksum does not match.
    Crc,
}

/// An error on the wire as one participant saw it. `Confinement` counts TEC and REC from the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorReport {
    /// The first error that the participant detected.
    pub error: BusError,
    /// Whether the participant was sending the frame.
    pub transmitting: bool,
    /// Dominant bits on the wire during the participant's passive error flag.
    pub dominant_in_flag: u16,
    /// Dominant bits in a row right after the participant's error flag: the flags of other participants.
    pub dominant_after_flag: u16,
}

/// A CAN controller as the bus sees it: a bxCAN peripheral, a node in this process, or a network client.
///
/// The bus calls the methods in the order of virtual time. `at` is the instant of the event on the wire. For
/// `start_of_frame` that instant may lie up to one quantum of the co-simulation before the time to which the
/// participant has already run (see the crate documentation).
pub trait Controller {
    /// How the controller takes part at `at`.
    fn attachment(&mut self, at: Time) -> Attachment;

    /// The earliest instant at which the controller requests to begin a frame, as known now; `None` without a request.
    /// The bus begins none of the controller's frames earlier.
    fn requested(&self) -> Option<Time>;

    /// The frame that the controller sends first at `at`; `None` when nothing was requested up to `at`.
    fn pending(&mut self, at: Time) -> Option<Frame>;

    /// A frame begins on the wire; with `transmitting` the frame is the one that `pending` returned.
    fn start_of_frame(&mut self, transmitting: bool, at: Time);

    /// The controller's frame lost the arbitration; the controller continues as a receiver.
    fn lost(&mut self, at: Time);

    /// The controller's frame was sent and acknowledged; `at` is the end of frame.
    fn sent(&mut self, at: Time);

    /// A frame of another participant is valid: `at` is the last but one bit of the end of frame.
    fn received(&mut self, frame: &Frame, at: Time);

    /// An error destroyed the frame on the wire; `at` is the end of the last error flag that this participant saw.
    fn error(&mut self, report: &ErrorReport, at: Time);

    /// The wire has been recessive since `since` and remains so until the next `start_of_frame`.
    fn idle(&mut self, since: Time);
}
