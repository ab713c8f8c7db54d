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
    /// 254: by event timer. The event that the manufacturer may add is none here, but for entering Operational.
    Timer,
    /// 255: by event timer; without one, with every change of a mapped value. What the event is, the device profile says:
    /// CiA 404 and CiA 417 say this.
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
            (254, _) => Some(Transmission::Timer),
            (255, _) => Some(Transmission::Event),
            _ => None,
        }
    }

    /// Whether neither SYNC nor a remote frame is needed to send it: 254 and 255.
    #[must_use]
    pub const fn is_event_driven(self) -> bool {
        matches!(self, Transmission::Timer | Transmission::Event)
    }

    /// Whether the SYNC sends or samples it: 0 to 240 and 252.
    #[must_use]
    pub const fn is_synchronous(self) -> bool {
        matches!(self, Transmission::SyncAcyclic | Transmission::SyncCyclic(_) | Transmission::SyncRemote)
    }

    /// Whether it is only sent on a remote frame, and so makes no sense where those are not allowed.
    #[must_use]
    pub const fn needs_remote(self) -> bool {
        matches!(self, Transmission::SyncRemote | Transmission::Remote)
    }
}
