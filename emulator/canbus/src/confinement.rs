//! Error confinement (ISO 11898-1:2015, 12.1.4): the two error counters and the states that follow from them.

use crate::{BusError, ErrorReport};

/// From this count on a controller is error passive.
const PASSIVE: u16 = 128;
/// From this transmit error count on a controller is bus-off.
const BUS_OFF: u16 = 256;
/// From this count on the warning flag is set.
const WARNING: u16 = 96;
/// The receive error counter after a correct reception by a controller whose counter was above 127.
const REC_AFTER_PASSIVE: u16 = 120;

/// The error state of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorState {
    /// Error active: the node sends active error flags.
    Active,
    /// Error passive: the node sends passive error flags and waits longer between two of its frames.
    Passive,
    /// Bus-off: the node takes no part in the traffic until 128 sequences of 11 recessive bits have passed.
    BusOff,
}

/// The transmit and the receive error counter of one controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Confinement {
    tec: u16,
    rec: u16,
}

impl Confinement {
    /// The transmit error counter, 0 to 256 and a little above when bus-off.
    pub fn tec(&self) -> u16 {
        self.tec
    }

    /// The receive error counter, 0 to 255.
    pub fn rec(&self) -> u16 {
        self.rec
    }

    /// The error state that follows from the counters.
    pub fn state(&self) -> ErrorState {
        match self.tec.max(self.rec.min(BUS_OFF - 1)) {
            BUS_OFF.. => ErrorState::BusOff,
            PASSIVE.. => ErrorState::Passive,
            _ => ErrorState::Active,
        }
    }

    /// Whether a counter has reached the warning limit of 96.
    pub fn warns(&self) -> bool {
        self.tec.max(self.rec) >= WARNING
    }

    /// A frame was sent (rule g).
    pub fn sent(&mut self) {
        self.tec = self.tec.saturating_sub(1);
    }

    /// A frame was received (rule h).
    pub fn received(&mut self) {
        self.rec = if self.rec >= PASSIVE { REC_AFTER_PASSIVE } else { self.rec.saturating_sub(1) };
    }

    /// An error was signalled (rules a, b, c and f).
    pub fn error(&mut self, report: &ErrorReport) {
        // Rule f: eight more for every eight dominant bits in a row after the flag.
        let stuck = report.dominant_after_flag / 8 * 8;
        if report.transmitting {
            let weight = if self.is_exempt(report) { 0 } else { 8 };
            self.tec = (self.tec + weight + stuck).min(BUS_OFF + 8);
        } else {
            // Rules a and b: the first receiver to detect the error sees the flags of the others after its own flag.
            let weight = if report.dominant_after_flag > 0 { 9 } else { 1 };
            self.rec = (self.rec + weight + stuck).min(BUS_OFF - 1);
        }
    }

    /// The two exceptions of rule c: a lone error-passive transmitter, and a stuff error in the arbitration field.
    fn is_exempt(&self, report: &ErrorReport) -> bool {
        match report.error {
            BusError::Ack => self.state() == ErrorState::Passive && report.dominant_in_flag == 0,
            BusError::Stuff => true,
            _ => false,
        }
    }
}
