//! The interface of bxCAN to the bus.

use canbus::{Attachment, Controller, ErrorReport, Frame, Time};

use super::BxCan;

impl Controller for BxCan {
    fn attachment(&mut self, at: Time) -> Attachment {
        self.advance(at);
        let timing = self.bit_timing();
        match () {
            () if !self.is_on_bus() => Attachment::Off,
            () if self.is_silent() => Attachment::Silent { timing },
            () if self.is_passive() => Attachment::Passive { timing },
            () => Attachment::Active { timing },
        }
    }

    fn requested(&self) -> Option<Time> {
        let requested = self.transmitter.requested().filter(|_| !self.is_silent())?;
        Some(requested.max(self.joins_at()?))
    }

    fn pending(&mut self, at: Time) -> Option<Frame> {
        self.transmitter.scheduled(self.by_request_order(), at)
    }

    fn start_of_frame(&mut self, transmitting: bool, at: Time) {
        self.hear_start(transmitting, at);
    }

    fn lost(&mut self, _at: Time) {
        self.transmitter.lost(self.gives_up());
    }

    fn sent(&mut self, _at: Time) {
        if self.transmitter.is_transmitting() {
            self.transmitter.sent();
            self.status.sent();
        }
    }

    fn received(&mut self, frame: &Frame, _at: Time) {
        if self.is_on_bus() {
            self.store(frame);
        }
    }

    fn error(&mut self, report: &ErrorReport, at: Time) {
        if self.is_on_bus() {
            self.status.failed(report);
            self.transmitter.failed(self.gives_up());
            self.recover(at);
        }
    }

    fn idle(&mut self, since: Time) {
        self.hear_idle(since);
    }
}
