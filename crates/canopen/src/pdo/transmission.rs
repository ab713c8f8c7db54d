//! Transmission types (CiA 301, table 72).

use core::num::NonZeroU8;

/// When a TPDO is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmission {
    /// 0: with the next SYNC after a change.
    SyncAcyclic,
    /// 1 to 240: with every n-th SYNC.
    SyncCyclic(NonZeroU8),
    /// 252: sampled with SYNC, sent on a remote frame.
    SyncRemote,
    /// 253: sampled and sent on a remote frame.
    Remote,
    /// 254 and 255: by event or event timer. What the event is, manufacturer (254) or device profile (255) say;
    /// here both mean the same.
    Event,
}

impl Transmission {
    /// `None` for the reserved types 241 to 251.
    #[must_use]
    pub const fn parse(value: u8) -> Option<Transmission> {
        match (value, NonZeroU8::new(value)) {
            (1..=240, Some(every)) => Some(Transmission::SyncCyclic(every)),
            (0, _) => Some(Transmission::SyncAcyclic),
            (252, _) => Some(Transmission::SyncRemote),
            (253, _) => Some(Transmission::Remote),
            (254 | 255, _) => Some(Transmission::Event),
            _ => None,
        }
    }

    /// Whether it is only sent on a remote frame, and so makes no sense where those are not allowed.
    #[must_use]
    pub const fn needs_remote(self) -> bool {
        matches!(self, Transmission::SyncRemote | Transmission::Remote)
    }
}
