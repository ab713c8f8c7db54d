//! Events on the bus since the last poll, and the state of the fault confinement from `CAN_ESR` (RM0390, 30.9.2).

/// Events that the controller has seen since the last poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Neither frame nor error.
    Silence,
    /// A frame without an error.
    Frame,
    /// An own frame without an acknowledge.
    Nobody,
    /// Any other error.
    Error,
}

/// Error state of the controller, by its error counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusState {
    /// Both counters below 96.
    #[default]
    Active,
    /// At least one counter is at 96 or more.
    Warning,
    /// At least one counter is above 127.
    Passive,
    /// The transmit error counter is above 255: the node is off the bus.
    Off,
}

impl BusState {
    /// The state in a value of `CAN_ESR`.
    #[must_use]
    pub fn from_esr(esr: u32) -> BusState {
        match esr & 0b111 {
            0b000 => BusState::Active,
            0b001 => BusState::Warning,
            0b010 | 0b011 => BusState::Passive,
            _ => BusState::Off,
        }
    }
}

/// Detects changes of the state. An interrupt signals that the state gets worse, but none that it gets better, so the
/// state must also be polled.
#[derive(Debug, Default)]
pub struct BusWatch {
    last: BusState,
}

impl BusWatch {
    /// The states before and now, if they differ.
    pub fn change(&mut self, now: BusState) -> Option<(BusState, BusState)> {
        let before = core::mem::replace(&mut self.last, now);
        (before != now).then_some((before, now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_flag_decides() {
        assert_eq!(BusState::from_esr(0x0000_0000), BusState::Active);
        assert_eq!(BusState::from_esr(0x6000_0001), BusState::Warning);
        assert_eq!(BusState::from_esr(0x8800_0003), BusState::Passive);
        assert_eq!(BusState::from_esr(0xFF00_0007), BusState::Off);
    }

    #[test]
    fn a_change_is_reported_once() {
        let mut watch = BusWatch::default();
        assert_eq!(watch.change(BusState::Active), None);
        assert_eq!(watch.change(BusState::Off), Some((BusState::Active, BusState::Off)));
        assert_eq!(watch.change(BusState::Off), None);
        assert_eq!(watch.change(BusState::Active), Some((BusState::Off, BusState::Active)));
    }
}
