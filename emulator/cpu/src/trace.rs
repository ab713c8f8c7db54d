//! A running hash of what the core did, so that two runs can be compared in one word.

use canbus::Time;

use crate::exception::Exception;

/// The hash of all exception entries with their time and return address.
#[derive(Clone, Debug)]
pub(crate) struct Trace(u64);

impl Trace {
    pub(crate) fn new() -> Trace {
        Trace(0xCBF2_9CE4_8422_2325)
    }

    pub(crate) fn hash(&self) -> u64 {
        self.0
    }

    pub(crate) fn entry(&mut self, exception: Exception, now: Time, pc: u32) {
        self.mix(u64::from(exception.0) << 32 | u64::from(pc));
        self.mix(now.0);
    }

    fn mix(&mut self, value: u64) {
        self.0 = (self.0 ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    }
}
