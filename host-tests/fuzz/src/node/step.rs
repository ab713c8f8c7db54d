//! What the world can do to a node.

use arbitrary::Arbitrary;
use node::BusEvent;
use profiles::board::RawSample;

/// One thing that happens.
#[derive(Arbitrary, Debug)]
pub(super) enum Step {
    /// An SDO request, as its bytes.
    Sdo([u8; 8]),
    /// An SDO upload of a row of the dictionary.
    Read { row: u16 },
    /// An expedited SDO download to a row of the dictionary, of the length that it has.
    Write { row: u16, value: [u8; 4] },
    /// An NMT command that exists.
    Nmt { command: u8, to_all: bool },
    /// A frame with one of the identifiers that FIFO 0 takes.
    Process { place: u8, len: u8, remote: bool, data: [u8; 8] },
    /// A frame with one of the identifiers that FIFO 1 takes.
    Service { place: u8, data: [u8; 8] },
    /// A frame with any identifier.
    Frame { id: u16, len: u8, remote: bool, data: [u8; 8] },
    /// An LSS request.
    Lss([u8; 8]),
    /// A millisecond with other readings.
    Sample { pressure: u32, supply: u32, temperature: u32, reference: u32, encoder: u16, buttons: [bool; 2] },
    /// A report of the CAN controller.
    Bus(Report),
    /// The next deadline comes.
    Deadline,
    /// Time passes, in us, whatever is due.
    Wait(u32),
    /// The bus takes no frame any more, or takes them again.
    Congest(bool),
    /// Power off and on.
    PowerCycle,
    /// The power will be cut, so many flash operations from now.
    PowerCut { after: u8 },
}

/// As [`BusEvent`].
#[derive(Arbitrary, Clone, Copy, Debug)]
pub(super) enum Report {
    Overrun,
    Warning,
    Passive,
    BusOff,
    Recovered,
}

impl From<Report> for BusEvent {
    fn from(report: Report) -> BusEvent {
        match report {
            Report::Overrun => BusEvent::Overrun,
            Report::Warning => BusEvent::Warning,
            Report::Passive => BusEvent::Passive,
            Report::BusOff => BusEvent::BusOff,
            Report::Recovered => BusEvent::Recovered,
        }
    }
}

/// The readings of a step. The sums are whatever the converter says.
pub(super) fn raw(pressure: u32, supply: u32, temperature: u32, reference: u32) -> RawSample {
    let most = 16 * 4095;
    let [pressure, supply, temperature, reference] =
        [pressure, supply, temperature, reference].map(|sum| sum % (most + 1));
    RawSample { pressure, supply, temperature, reference, thermistor: pressure, count: 16 }
}
