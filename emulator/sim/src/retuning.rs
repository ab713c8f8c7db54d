//! The host's adapters follow when a master moves the bus to another bit rate by LSS, as their user would set them anew.

use canbus::{Frame, Id, StandardId, Time};
use canopen::lss::{BitRate, Request};

/// CAN-ID of LSS requests (CiA 305).
const LSS_REQUEST: u16 = 0x7E5;

/// What has been heard of a change of the bit rate.
#[derive(Debug, Default)]
pub(crate) struct Retuning {
    chosen: Option<BitRate>,
    due: Option<(Time, BitRate)>,
}

impl Retuning {
    /// Takes a frame of the bus with its end.
    pub(crate) fn on_frame(&mut self, frame: &Frame, at: Time) {
        let is_request = StandardId::new(LSS_REQUEST).map(Id::Standard) == Some(frame.id());
        let request = frame.bytes().try_into().ok().filter(|_| is_request).and_then(Request::parse);
        match request {
            Some(Request::BitTiming { table: 0, index }) => self.chosen = BitRate::from_index(index),
            Some(Request::Activate { delay }) => {
                // Nobody can be set to a rate that is still to be found.
                let chosen = self.chosen.filter(|&rate| rate != BitRate::AUTO);
                self.due = chosen.map(|rate| (at + Time::from_millis(delay.into()), rate));
            }
            _ => {}
        }
    }

    /// When the adapters change.
    pub(crate) fn due(&self) -> Time {
        self.due.map_or(Time::NEVER, |(due, _)| due)
    }

    /// The bit rate to change to in kbit/s, once it is time.
    pub(crate) fn take(&mut self, now: Time) -> Option<u16> {
        let (_, rate) = self.due.take_if(|(due, _)| *due <= now)?;
        Some(rate.kbit())
    }
}
