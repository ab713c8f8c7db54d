//! One RPDO: when its data is accepted.
//!
//! The types 0 to 240 accept the data with the next SYNC, the types 254 and 255 at once. With an event timer, the next
//! frame must arrive before the timer elapses.

use super::{Content, Layout, Links};
use crate::array::Element;
use crate::dictionary::{Addressing, Transmission};
use crate::emcy::Fault;
use crate::{CanId, Frame, Span, Tick};

/// Settings of a valid RPDO, from the objects 1400h.. and 1600h.. .
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

    /// `None` for a transmission type that an RPDO does not support.
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
    /// The required length of a frame in bytes.
    fn len(&self) -> usize {
        match &self.content {
            Content::Objects(layout) => layout.len().into(),
            Content::Multiplexed(_) => 8,
        }
    }
}

/// The result of a reception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reception {
    /// The length is as mapped.
    Complete,
    /// Too short: the data is not used (EMCY 8210h).
    TooShort,
    /// Too long: the first bytes are used (EMCY 8220h).
    TooLong,
    /// A multiplexed PDO of at least eight bytes: the device finds the object.
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

impl RpdoFault {
    pub(crate) const ALL: [RpdoFault; 3] = [RpdoFault::TooShort, RpdoFault::TooLong, RpdoFault::Deadline];
}

/// An RPDO. Only valid RPDOs are in the chains.
#[derive(Debug)]
pub struct Rpdo {
    /// The PDOs that follow in the chains.
    pub(crate) links: Links,
    /// Index of the communication parameter.
    pub(crate) index: u16,
    is_valid: bool,
    settings: RpdoSettings,
    /// The newest data that waits for a SYNC.
    waiting: Option<[u8; 8]>,
    /// When the next frame is missing; `NEVER` before the first reception.
    due: Tick,
    /// The active faults, one bit for each [`RpdoFault`].
    faults: u8,
}

impl Element for Rpdo {
    const NEW: Rpdo = Rpdo {
        // Set for all PDOs when the chains are made.
        links: Links::NONE,
        index: 0,
        is_valid: false,
        settings: RpdoSettings::UNUSED,
        waiting: None,
        due: Tick::NEVER,
        faults: 0,
    };
}

impl Rpdo {
    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.due.shift(by);
    }

    /// Whether the data waits for a SYNC.
    pub(crate) fn is_synchronous(&self) -> bool {
        self.settings.is_synchronous
    }

    /// Whether this is a multiplexed RPDO.
    pub(crate) fn is_multiplexed(&self) -> bool {
        matches!(self.settings.content, Content::Multiplexed(_))
    }

    /// Takes new settings and discards the state of the old ones.
    pub(crate) fn configure(&mut self, settings: Option<RpdoSettings>) {
        self.is_valid = settings.is_some();
        if let Some(settings) = settings {
            self.settings = settings;
        }
        self.stop();
    }

    /// Discards waiting data and the deadline, when the NMT state changes.
    pub(crate) fn stop(&mut self) {
        (self.waiting, self.due) = (None, Tick::NEVER);
    }

    /// The CAN-ID of a valid RPDO.
    pub(crate) fn id(&self) -> Option<CanId> {
        self.is_valid.then_some(self.settings.id)
    }

    /// Whether a frame has the CAN-ID of this RPDO, which must be valid.
    pub(crate) fn is_of(&self, frame: &Frame) -> bool {
        self.settings.id.get() == frame.id()
    }

    /// Takes a data frame of this RPDO. Returns the result of the reception, and whether the data is valid at once.
    /// `late` is true when the synchronous window is over: a synchronous RPDO is then ignored.
    #[inline]
    pub(crate) fn take(&mut self, frame: &Frame, now: Tick, late: bool) -> (Reception, bool) {
        let settings = &self.settings;
        let mapped = settings.len();
        if frame.len() < mapped {
            return (Reception::TooShort, false);
        }
        self.due = match settings.deadline {
            0 => Tick::NEVER,
            deadline => now.plus(Span::from_millis(deadline)),
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

    /// Takes the data that waited for a SYNC: the SYNC has arrived.
    pub(crate) fn take_waiting(&mut self) -> Option<[u8; 8]> {
        self.waiting.take()
    }

    /// The locations of the mapped objects; `None` for a multiplexed RPDO.
    pub(crate) fn layout(&self) -> Option<&Layout> {
        match &self.settings.content {
            Content::Objects(layout) => Some(layout),
            Content::Multiplexed(_) => None,
        }
    }

    /// Sets or clears a fault. Returns whether the state of the fault has changed.
    pub(crate) fn set_fault(&mut self, kind: RpdoFault, active: bool) -> bool {
        let (before, bit) = (self.faults, 1 << kind as u8);
        self.faults = if active { before | bit } else { before & !bit };
        self.faults != before
    }

    /// The number of the RPDO, 1 to 512.
    pub(crate) fn number(&self) -> u16 {
        (self.index & 0x1FF) + 1
    }

    /// A fault of this RPDO.
    pub(crate) fn fault(&self, kind: RpdoFault) -> Fault {
        match kind {
            RpdoFault::TooShort => Fault::RpdoTooShort(self.number()),
            RpdoFault::TooLong => Fault::RpdoTooLong(self.number()),
            RpdoFault::Deadline => Fault::RpdoDeadline(self.number()),
        }
    }

    /// Whether a fault is active.
    pub(crate) fn has(&self, kind: RpdoFault) -> bool {
        self.faults & 1 << kind as u8 != 0
    }

    /// Whether any fault is active.
    pub(crate) fn has_faults(&self) -> bool {
        self.faults != 0
    }

    /// When the next frame is missing.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// Whether the deadline has passed. Reported once.
    pub(crate) fn expire(&mut self, now: Tick) -> bool {
        let is_over = now >= self.due;
        if is_over {
            self.due = Tick::NEVER;
        }
        is_over
    }
}
