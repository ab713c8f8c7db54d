//! Loop-back mode: the controller receives its own frames, without the bus and its acknowledgement (RM0390, bxCAN loop
//! back mode).

use canbus::{Frame, Time, frame_bits};

use super::modes::Mode;
use super::{BxCan, INRQ, SLEEP};

/// A frame in loop-back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loop {
    frame: Frame,
    pub(super) end: Time,
}

impl BxCan {
    /// Sends the scheduled mailbox unless a frame is under way.
    pub(super) fn begin_loop(&mut self, at: Time) {
        if self.mode != Mode::Normal || !self.loops_back() || self.looped.is_some() {
            return;
        }
        let order = self.by_request_order();
        if let Some(frame) = self.transmitter.scheduled(order, at) {
            self.transmitter.begin(order, at);
            self.looped = Some(Loop { frame, end: at + self.bit() * (frame_bits(&frame) - 3) });
        }
    }

    /// The end of a frame in loop-back.
    pub(super) fn end_loop(&mut self, looped: &Loop) {
        self.transmitter.sent();
        self.status.sent();
        if self.lost_loops > 0 {
            self.lost_loops -= 1;
        } else {
            self.store(&looped.frame);
        }
        if self.is_set(INRQ) || self.is_set(SLEEP) {
            self.follow_requests(looped.end);
        }
        self.begin_loop(looped.end + self.bit() * 3);
    }
}
