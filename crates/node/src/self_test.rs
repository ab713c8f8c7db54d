//! 2005h: values of the board, for its bring-up. The firmware knows the values; the node knows the object.

use profiles::communication::{SELF_TEST, SELF_TEST_KEY};

use crate::Protocol;

impl Protocol {
    /// Shows the selected value. To be called before an upload is served. `value` is a parameter, not a field: the bound of
    /// the stack allows no call through a pointer that is stored.
    #[inline(never)]
    pub fn self_test(&mut self, value: fn(u8) -> u32) {
        self.device.show(|application, image| {
            let Ok(entry) = application.setup.personality.dictionary().find(SELF_TEST, 0) else { return };
            let written = entry.field().u32(image);
            if written >> 8 == SELF_TEST_KEY {
                entry.field().set_u32(image, value(written.to_le_bytes()[0]));
            }
        });
    }
}
