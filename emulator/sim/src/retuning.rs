//! The host's adapters follow a change of the bit rate that a master makes by LSS, as if their user had set them.

use canbus::{Frame, Id, StandardId, Time};
use canopen::lss::{BitRate, Request};

/// CAN-ID of LSS requests (CiA 305).
const LSS_REQUEST: u16 = 0x7E5;

/// The requested change of the bit rate.
#[derive(Debug, Default)]
pub(crate) struct Retuning {
    chosen: Option<BitRate>,
    due: Option<(Time, BitRate)>,
}

impl Retuning {
    /// Processes a frame of the bus; `at` is the end of the frame.
    pub(crate) fn on_frame(&mut self, frame: &Frame, at: Time) {
        let is_request = StandardId::new(LSS_REQUEST).map(Id::Standard) == Some(frame.id());
        let request = frame.bytes().try_into().ok().filter(|_| is_request).and_then(Request::parse);
        match request {
            Some(Request::BitTiming { table: 0, index }) => self.chosen = BitRate::from_index(index),
            Some(Request::Activate { delay }) => {
                // An adapter cannot be set to a rate that has still to be detected.
                let chosen = self.chosen.filter(|&rate| rate != BitRate::AUTO);
                self.due = chosen.map(|rate| (at + Time::from_millis(delay.into()), rate));
            }
            _ => {}
        }
    }

    /// The instant at which the adapters change their rate.
    pub(crate) fn due(&self) -> Time {
        self.due.map_or(Time::NEVER, |(due, _)| due)
    }

    /// The new bit rate in kbit/s, once its instant has come.
    pub(crate) fn take(&mut self, now: Time) -> Option<u16> {
        let (_, rate) = self.due.take_if(|(due, _)| *due <= now)?;
        Some(rate.kbit())
    }
}
