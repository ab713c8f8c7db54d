//! 2001h: events of the hardware that were lost and recovered from, counted since the start.

use profiles::communication;

use crate::Protocol;
use crate::application::{LOST_EVENTS, NodeApplication};

impl Protocol {
    /// Shows the numbers of lost events since the start, in the order of the sub-indexes of 2001h.
    pub fn show_lost_events(&mut self, counts: &[u32; LOST_EVENTS]) {
        self.device.application_mut().lost_events = *counts;
        self.device.show(|application, image| application.show_lost_events(image));
    }
}

impl NodeApplication {
    pub(crate) fn show_lost_events(&self, image: &mut [u8]) {
        for (sub, count) in (1..).zip(&self.lost_events) {
            self.show(communication::LOST_EVENTS, sub, &count.to_le_bytes(), image);
        }
    }
}
