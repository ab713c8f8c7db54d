//! Transmission types (CiA 301, table 72).

use core::num::NonZeroU8;

/// The transmission type of a TPDO: when the TPDO is sent.
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
    /// 254: by event timer, and on entering Operational. CiA 301 leaves further events to the manufacturer; here
    /// [`Device::send_tpdo`](crate::Device::send_tpdo) is the only one.
    Timer,
    /// 255: by event timer; without one, with every change of a mapped value. CiA 301 leaves the event to the device
    /// profile; CiA 404 and CiA 417 define it this way.
    Event,
}

impl Transmission {
    /// `None` for the reserved types 241 to 251.
    #[must_use]
    #[inline(never)]
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

    /// Whether the PDO is sent without SYNC and remote frames: 254 and 255.
    #[must_use]
    pub const fn is_event_driven(self) -> bool {
        matches!(self, Transmission::Timer | Transmission::Event)
    }

    /// Whether SYNC sends or samples the PDO: 0 to 240 and 252.
    #[must_use]
    pub const fn is_synchronous(self) -> bool {
        matches!(self, Transmission::SyncAcyclic | Transmission::SyncCyclic(_) | Transmission::SyncRemote)
    }

    /// Whether the PDO is sent on remote frames only, and therefore requires that remote frames are allowed: 252 and
    /// 253.
    #[must_use]
    pub const fn needs_remote(self) -> bool {
        matches!(self, Transmission::SyncRemote | Transmission::Remote)
    }
}
