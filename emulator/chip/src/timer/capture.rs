//! Input capture (RM0390 section 17.3.5, RM0090 section 18.3.5), without prescaler and filter.

use super::{DIER_UDE, Timer};
use crate::register::{bit, field, flag};

impl Timer {
    /// Copies the counter into the register of an input channel when the channel is set up for this edge. Returns
    /// whether the capture requests DMA.
    pub(crate) fn capture(&mut self, channel: usize, rising: bool) -> bool {
        let enabled = bit(self.ccer, channel as u32 * 4);
        let captured = enabled && self.captures(channel, rising);
        if captured {
            let flag_bit = channel as u32 + 1;
            // The last capture was not read: CCxOF.
            self.sr |= flag(bit(self.sr, flag_bit), flag_bit + 8) | flag(true, flag_bit);
            self.compare[channel].write(self.counter.value(), false);
        }
        captured && bit(self.dier, DIER_UDE + 1 + channel as u32)
    }

    /// Whether the channel is an input for its own pin and this edge (CCxP and CCxNP).
    fn captures(&self, channel: usize, rising: bool) -> bool {
        let own_pin = field(self.mode(channel), 0, 2) == 1;
        let polarity = field(self.ccer, channel as u32 * 4, 4) & 0b1010;
        let both = polarity == 0b1010;
        own_pin && (both || rising == (polarity == 0))
    }

    /// Whether the channel captures edges of its pin.
    pub(crate) fn listens(&self, channel: usize) -> bool {
        self.is_input(channel) && bit(self.ccer, channel as u32 * 4)
    }
}
