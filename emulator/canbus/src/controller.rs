//! What the bus asks of everything that is wired to it.

use crate::{Frame, Time};

/// How a controller takes part in the traffic at a given moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attachment {
    /// Not on the bus: in initialisation, asleep, without power, or bus-off.
    Off,
    /// Hears everything, sends and acknowledges nothing (silent mode).
    Silent {
        /// Length of its nominal bit.
        bit: Time,
    },
    /// Takes part; its error flags destroy a frame that it sees as faulty.
    Active {
        /// Length of its nominal bit.
        bit: Time,
    },
    /// Takes part, but signals errors only recessively.
    Passive {
        /// Length of its nominal bit.
        bit: Time,
    },
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

/// A CAN controller as the bus sees it: a bxCAN peripheral, a node in this process, or a network client.
///
/// The bus calls these in the order of virtual time. `at` is the instant of the event on the wire.
pub trait Controller {
    /// How it takes part now.
    fn attachment(&self) -> Attachment;

    /// The earliest instant at which a frame was or will be ready to send, and that frame: the one that wins
    /// inside this controller at `at`. `None` when nothing was requested up to `at`.
    fn pending(&mut self, at: Time) -> Option<Frame>;

    /// When the oldest request was made; `None` without one. The bus starts no frame before it.
    fn requested(&self) -> Option<Time>;

    /// Its pending frame now goes out on the wire (for all contenders; losers hear `lost`).
    fn started(&mut self, at: Time);

    /// Arbitration was lost to a lower identifier.
    fn lost(&mut self, at: Time);

    /// Its frame was sent and acknowledged; `at` is the end of frame.
    fn sent(&mut self, at: Time);

    /// A frame of somebody else's ended without error.
    fn received(&mut self, frame: &Frame, at: Time);

    /// An error on the wire while `transmitting` or receiving.
    fn error(&mut self, error: BusError, transmitting: bool, at: Time);
}
