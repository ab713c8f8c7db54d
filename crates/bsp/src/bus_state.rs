//! The state of the fault confinement, from `CAN_ESR` (RM0390, 30.9.2).

/// Error state of the controller, by its error counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusState {
    /// Both counters below 96.
    #[default]
    Active,
    /// One of them at 96 or more.
    Warning,
    /// One of them above 127.
    Passive,
    /// The transmit error counter above 255: the node is off the bus.
    Off,
}

impl BusState {
    /// The state that a value of `CAN_ESR` means.
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

/// Notices changes of the state. An interrupt tells when the state gets worse, none when the state gets better: the state has to be
/// looked at from time to time as well.
#[derive(Debug, Default)]
pub struct BusWatch {
    last: BusState,
}

impl BusWatch {
    /// The states before and now, when they differ.
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
    fn a_change_is_told_once() {
        let mut watch = BusWatch::default();
        assert_eq!(watch.change(BusState::Active), None);
        assert_eq!(watch.change(BusState::Off), Some((BusState::Active, BusState::Off)));
        assert_eq!(watch.change(BusState::Off), None);
        assert_eq!(watch.change(BusState::Active), Some((BusState::Off, BusState::Active)));
    }
}
