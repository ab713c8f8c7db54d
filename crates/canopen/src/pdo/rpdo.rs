//! One RPDO: when its data is taken.
//!
//! The types 0 to 240 take it with the next SYNC, the types 254 and 255 at once. With an event timer, it must come
//! again within that time.

use super::{Addressing, Content, Layout, Links, Transmission};
use crate::{CanId, Duration, Frame, Instant};

/// Settings of a valid RPDO, from the objects 1400h.. and 1600h...
#[derive(Clone, Copy, Debug)]
pub(crate) struct RpdoSettings {
    id: CanId,
    is_synchronous: bool,
    /// Deadline between two receptions in ms; 0 for none.
    deadline: u16,
    content: Content,
}

impl RpdoSettings {
    /// Settings of an RPDO that is not valid.
    const UNUSED: RpdoSettings = RpdoSettings {
        id: CanId::NMT,
        is_synchronous: false,
        deadline: 0,
        content: Content::Objects(Layout::EMPTY),
    };

    /// `None` for a transmission type that an RPDO cannot have.
    pub(crate) fn new(
        id: CanId,
        transmission: Transmission,
        deadline: u16,
        content: Content,
    ) -> Option<RpdoSettings> {
        let is_synchronous = !transmission.is_event_driven();
        (!transmission.needs_remote()).then_some(RpdoSettings { id, is_synchronous, deadline, content })
    }
}

impl RpdoSettings {
    /// Bytes that it must have.
    fn len(&self) -> usize {
        match &self.content {
            Content::Objects(layout) => layout.len().into(),
            Content::Multiplexed(_) => 8,
        }
    }
}

/// How the length of a frame compares with the mapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reception {
    /// As mapped.
    Complete,
    /// Too short: not taken (EMCY 8210h).
    TooShort,
    /// Too long: the first bytes are taken (EMCY 8220h).
    TooLong,
    /// Complete, and of this kind: the device finds out where it goes.
    Multiplexed(Addressing),
}

/// Faults of the reception of an RPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum RpdoFault {
    TooShort,
    TooLong,
    Deadline,
}

/// An RPDO. One that is not valid is in no chain.
#[derive(Debug)]
pub(crate) struct Rpdo {
    /// The PDOs that follow in the chains.
    pub(crate) links: Links,
    /// Index of its communication object.
    pub(crate) index: u16,
    is_valid: bool,
    settings: RpdoSettings,
    /// Data that waits for SYNC, the newest.
    waiting: Option<[u8; 8]>,
    /// When the deadline passes; `NEVER` before the first reception.
    due: Instant,
    /// The faults that it has, a bit for each [`RpdoFault`].
    faults: u8,
}

impl Rpdo {
    pub(crate) const fn new() -> Rpdo {
        Rpdo {
            links: Links::END,
            index: 0,
            is_valid: false,
            settings: RpdoSettings::UNUSED,
            waiting: None,
            due: Instant::NEVER,
            faults: 0,
        }
    }

    /// Whether its data waits for the SYNC.
    pub(crate) fn is_synchronous(&self) -> bool {
        self.settings.is_synchronous
    }

    /// Whether it carries a multiplexed PDO.
    pub(crate) fn is_multiplexed(&self) -> bool {
        matches!(self.settings.content, Content::Multiplexed(_))
    }

    /// Takes new settings and starts afresh.
    pub(crate) fn configure(&mut self, settings: Option<RpdoSettings>) {
        self.is_valid = settings.is_some();
        self.settings = settings.unwrap_or(RpdoSettings::UNUSED);
        self.stop();
    }

    /// Leaving Operational.
    pub(crate) fn stop(&mut self) {
        (self.waiting, self.due) = (None, Instant::NEVER);
    }

    /// Its CAN-ID, while it is valid.
    pub(crate) fn id(&self) -> Option<CanId> {
        self.is_valid.then_some(self.settings.id)
    }

    /// Whether a frame has the CAN-ID of this RPDO, which is in a chain.
    pub(crate) fn is_of(&self, frame: &Frame) -> bool {
        self.settings.id.get() == frame.id()
    }

    /// Takes a data frame of this PDO: how its length compares, and whether the data is valid at once. `late` is true when
    /// the synchronous window is over: a synchronous PDO is then ignored.
    #[inline]
    pub(crate) fn take(&mut self, frame: &Frame, now: Instant, late: bool) -> (Reception, bool) {
        let settings = &self.settings;
        let mapped = settings.len();
        if frame.len() < mapped {
            return (Reception::TooShort, false);
        }
        self.due = match settings.deadline {
            0 => Instant::NEVER,
            deadline => now + Duration::from_millis(deadline.into()),
        };
        let reception = if frame.len() == mapped { Reception::Complete } else { Reception::TooLong };
        match (&settings.content, settings.is_synchronous) {
            (Content::Multiplexed(addressing), _) => (Reception::Multiplexed(*addressing), false),
            (Content::Objects(_), false) => (reception, true),
            (Content::Objects(_), true) => {
                if !late {
                    self.waiting = Some(frame.bytes());
                }
                (reception, false)
            }
        }
    }

    /// A SYNC arrived: what waits becomes valid.
    pub(crate) fn take_waiting(&mut self) -> Option<[u8; 8]> {
        self.waiting.take()
    }

    /// Where the data goes.
    pub(crate) fn layout(&self) -> Option<&Layout> {
        match &self.settings.content {
            Content::Objects(layout) => Some(layout),
            Content::Multiplexed(_) => None,
        }
    }

    /// Takes note of a fault; whether that is a change.
    pub(crate) fn set_fault(&mut self, kind: RpdoFault, active: bool) -> bool {
        let (before, bit) = (self.faults, 1 << kind as u8);
        self.faults = if active { before | bit } else { before & !bit };
        self.faults != before
    }

    /// Whether it has any fault.
    pub(crate) fn has_faults(&self) -> bool {
        self.faults != 0
    }

    /// The next instant at which a reception is missing.
    pub(crate) fn due(&self) -> Instant {
        self.due
    }

    /// Whether the deadline has just passed.
    pub(crate) fn expire(&mut self, now: Instant) -> bool {
        let is_over = now >= self.due;
        if is_over {
            self.due = Instant::NEVER;
        }
        is_over
    }
}
