//! 2001h: events of the hardware that were lost and made good, counted since the start. All zero is what a healthy board shows.

use crate::Protocol;
use crate::profile::Profile;
use canopen::dictionary::{Access, Object, Type};

/// Index of the object.
const INDEX: u16 = 0x2001;

/// How many kinds of events there are: sub-indexes 1 to this one.
pub const LOST_EVENTS: usize = 8;

const fn count(sub: u8, name: &'static str) -> Object {
    Object::new(INDEX, sub, name, Type::Unsigned32, Access::ReadOnly)
}

/// The rows.
pub(crate) const OBJECTS: &[Object] = &[
    Object::highest(INDEX, LOST_EVENTS as u8, "Lost events"),
    count(1, "Received frames"),
    count(2, "Milliseconds of samples"),
    count(3, "Restarts of the sampling"),
    count(4, "SSI words"),
    count(5, "Restarts of the index capture"),
    count(6, "Timer alarms"),
    count(7, "Writes to the backup memory"),
    count(8, "Flash operations"),
];

impl Protocol {
    /// Shows how many events have been lost since the start, in the order of the sub-indexes of 2001h.
    pub fn show_lost_events(&mut self, counts: &[u32; LOST_EVENTS]) {
        self.device.application_mut().lost_events = *counts;
        self.device.show(|profile, image| profile.show_lost_events(image));
    }
}

impl Profile {
    pub(crate) fn show_lost_events(&self, image: &mut [u8]) {
        for (sub, count) in (1..).zip(&self.lost_events) {
            self.show(INDEX, sub, &count.to_le_bytes(), image);
        }
    }
}
