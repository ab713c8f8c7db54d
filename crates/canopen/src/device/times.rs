//! The time stamp in the device: object 1012h.

use super::inner::Inner;
use super::{Application, Definition};
use crate::Frame;
use crate::time_stamp::TimeOfDay;

impl<D: Definition> Inner<D> {
    pub(super) fn configure_time(&mut self) {
        self.time_stamp.configure(self.number(0x1012, 0));
    }

    /// Takes a frame, if it is a time stamp and the NMT state allows it. Returns whether it does.
    #[inline(never)]
    pub(super) fn on_time(&mut self, frame: &Frame) -> bool {
        let time = self.time_stamp.take(frame).filter(|_| self.state.has_services());
        if let Some(time) = time {
            self.application.time(time, self.image.as_mut());
        }
        time.is_some()
    }

    /// The frame with a time, if the device may send it now.
    pub(super) fn time_frame(&self, time: TimeOfDay) -> Option<Frame> {
        let may_send = self.state.has_services();
        self.time_stamp.frame(time).filter(|_| may_send)
    }
}
