//! The events that can happen to a node.

use arbitrary::Arbitrary;
use node::BusEvent;
use profiles::board::RawSample;

/// Frames in the transmit queue of the firmware.
pub(super) const LONGEST_QUEUE: usize = 32;

/// One event.
#[derive(Arbitrary, Debug)]
pub(super) enum Step {
    /// An SDO request with arbitrary bytes.
    Sdo([u8; 8]),
    /// An SDO upload of a row of the dictionary.
    Read { row: u16 },
    /// An expedited SDO download to a row of the dictionary, with the length of the object ([`Step::download`]).
    Write { row: u16, value: [u8; 4] },
    /// A defined NMT command.
    Nmt { command: u8, to_all: bool },
    /// A frame with one of the identifiers of FIFO 0.
    Process { place: u8, len: u8, remote: bool, data: [u8; 8] },
    /// A frame with one of the identifiers of FIFO 1.
    Service { place: u8, data: [u8; 8] },
    /// A frame with any identifier.
    Frame { id: u16, len: u8, remote: bool, data: [u8; 8] },
    /// An LSS request.
    Lss([u8; 8]),
    /// A millisecond with new readings.
    Sample { pressure: u32, supply: u32, temperature: u32, reference: u32, encoder: u16, buttons: [bool; 2] },
    /// A report of the CAN controller.
    Bus(Report),
    /// Time passes to the next deadline.
    Deadline,
    /// Time passes, in us, beyond any deadlines.
    Wait(u32),
    /// The bus stops taking frames, or takes frames again, with a queue of any length ([`Step::queue`]).
    Congest(u8),
    /// Power off and on.
    PowerCycle,
    /// A power cut, after `after` further flash operations.
    PowerCut { after: u8 },
}

impl Step {
    /// The value of a download: the given one, one that switches a PDO off, or 0, which deselects.
    pub(super) fn download(row: u16, value: [u8; 4]) -> [u8; 4] {
        match row >> 12 {
            15 => [0; 4],
            14 => [value[0], value[1], 0, 0x80],
            _ => value,
        }
    }

    /// Whether the bus takes no frames, and the length of the queue: that of the firmware, or a shorter one.
    pub(super) fn queue(congestion: u8) -> (bool, usize) {
        let length = usize::from(congestion >> 1) % LONGEST_QUEUE;
        (congestion & 1 == 1, if length == 0 { LONGEST_QUEUE } else { length })
    }
}

/// A [`BusEvent`] for the fuzzer.
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

/// The readings of a step. The sums have any values.
pub(super) fn raw(pressure: u32, supply: u32, temperature: u32, reference: u32) -> RawSample {
    let most = 16 * 4095;
    let [pressure, supply, temperature, reference] =
        [pressure, supply, temperature, reference].map(|sum| sum % (most + 1));
    RawSample { pressure, supply, temperature, reference, thermistor: pressure, count: 16 }
}
