//! SYNC consumer (CiA 301, 7.2.5): recognises SYNC messages, monitors their period and the synchronous window. The
//! producer is in its own file.

mod producer;

pub(crate) use producer::Producer;

use crate::sdo::Abort;
use crate::{CanId, CobId, Frame, Span, Tick};

/// A SYNC message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sync {
    /// The counter, if 1019h requires one.
    pub(crate) counter: Option<u8>,
}

/// A SYNC whose length is not as 1019h requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WrongLength;

/// The SYNC objects of the dictionary.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// 1005h, COB-ID of SYNC.
    pub(crate) cob_id: u32,
    /// 1006h, communication cycle period in us; 0 for no monitoring.
    pub(crate) period: u32,
    /// 1007h, synchronous window length in us; 0 for a window until the next SYNC.
    pub(crate) window: u32,
    /// 1019h, synchronous counter overflow value; 0 for no counter.
    pub(crate) overflow: u8,
}

/// Recognises SYNC messages and monitors period and window.
#[derive(Debug)]
pub(crate) struct Consumer {
    id: CanId,
    settings: Settings,
    /// When the next SYNC is missing; `NEVER` before the first SYNC.
    due: Tick,
    window_end: Tick,
    /// The last SYNC was missing, or had the wrong length.
    is_disturbed: bool,
}

impl Consumer {
    pub(crate) const fn new() -> Consumer {
        Consumer {
            id: CanId::of_service(0x080, 0),
            settings: Settings { cob_id: 0x80, period: 0, window: 0, overflow: 0 },
            due: Tick::NEVER,
            window_end: Tick::NEVER,
            is_disturbed: false,
        }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.due.shift(by);
        self.window_end.shift(by);
    }

    /// Takes new settings. Monitoring begins with the next SYNC.
    pub(crate) fn configure(&mut self, settings: Settings) {
        self.id = CobId::parse(settings.cob_id).map_or(self.id, |cob_id| cob_id.id);
        self.settings = settings;
        self.is_disturbed = false;
        self.stop();
    }

    /// Takes a new window, which applies from the next SYNC on.
    pub(crate) fn set_window(&mut self, window: u32) {
        self.settings.window = window;
    }

    /// After a change of the NMT state: period and window begin again with the next SYNC, which ends the fault of a missing
    /// one.
    pub(crate) fn stop(&mut self) {
        (self.due, self.window_end) = (Tick::NEVER, Tick::NEVER);
    }

    pub(crate) fn id(&self) -> CanId {
        self.id
    }

    /// Whether a frame is a SYNC. A remote frame with the same identifier is not.
    pub(crate) fn accepts(&self, frame: &Frame) -> bool {
        frame.id() == self.id.get() && !frame.is_remote()
    }

    /// Takes a SYNC, that is a frame for which `accepts` is `true`.
    pub(crate) fn take(&mut self, frame: &Frame, now: Tick) -> Result<Sync, WrongLength> {
        let counter = match (frame.data(), self.settings.overflow) {
            ([], 0) => None,
            (&[counter], 1..) => Some(counter),
            _ => {
                self.is_disturbed = true;
                return Err(WrongLength);
            }
        };
        let Settings { period, window, .. } = self.settings;
        self.window_end = if window == 0 { Tick::NEVER } else { now.plus_long(window) };
        // A SYNC is missing after one and a half periods, at the latest after 71 minutes.
        self.due = if period == 0 { Tick::NEVER } else { now.plus_long(period.saturating_add(period / 2)) };
        Ok(Sync { counter })
    }

    /// Whether the synchronous window after the last SYNC is over.
    pub(crate) fn is_window_over(&self, now: Tick) -> bool {
        now > self.window_end
    }

    /// The next instant at which a SYNC is missing.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// Whether a SYNC is missing. Reported once.
    pub(crate) fn expire(&mut self, now: Tick) -> bool {
        let is_missing = now >= self.due;
        if is_missing {
            (self.due, self.is_disturbed) = (Tick::NEVER, true);
        }
        is_missing
    }

    /// Whether the SYNC before this one was missing or had the wrong length. Reported once.
    pub(crate) fn is_back(&mut self) -> bool {
        let is_back = self.is_disturbed;
        // Most SYNCs store nothing.
        if is_back {
            self.is_disturbed = false;
        }
        is_back
    }
}

/// Checks a new value of 1005h of a device that consumes SYNC only: bit 30 would make it a producer. Bit 31 has no
/// meaning.
pub(crate) fn check_cob_id(value: u32) -> Result<(), Abort> {
    let cob_id = CobId::parse(value).ok_or(Abort::InvalidValue)?;
    if cob_id.bit30 || cob_id.id.is_restricted() { Err(Abort::InvalidValue) } else { Ok(()) }
}

/// Checks a new value of 1005h of a device that can produce SYNC. The CAN-ID cannot change while the device produces.
pub(crate) fn check_producer(old: u32, new: u32) -> Result<(), Abort> {
    let new = CobId::parse(new).filter(|new| !new.id.is_restricted()).ok_or(Abort::InvalidValue)?;
    let moves = CobId::parse(old).is_some_and(|old| old.bit30 && new.bit30 && old.id != new.id);
    if moves { Err(Abort::InvalidValue) } else { Ok(()) }
}

/// Checks a new value of 1019h, which cannot change while there is a period (1006h).
pub(crate) fn check_overflow(value: u32, period: u32) -> Result<(), Abort> {
    if period != 0 {
        return Err(Abort::DeviceState);
    }
    if matches!(value, 0 | 2..=240) { Ok(()) } else { Err(Abort::InvalidValue) }
}
