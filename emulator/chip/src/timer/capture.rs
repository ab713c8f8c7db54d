//! Input capture (RM0390 section 17.3.5, RM0090 section 18.3.5), without prescaler and filter.

use super::{DIER_UDE, Timer};
use crate::register::{bit, field, flag};

impl Timer {
    /// Takes the value of the counter into the register of an input channel (an edge that it is set up for). Tells whether
    /// that asks for DMA.
    pub(crate) fn capture(&mut self, channel: usize, rising: bool) -> bool {
        let enabled = bit(self.ccer, channel as u32 * 4);
        let captured = enabled && self.captures(channel, rising);
        if captured {
            let flag_bit = channel as u32 + 1;
            // A capture over one that was not read: CCxOF.
            self.sr |= flag(bit(self.sr, flag_bit), flag_bit + 8) | flag(true, flag_bit);
            self.compare[channel].write(self.counter.value(), false);
        }
        captured && bit(self.dier, DIER_UDE + 1 + channel as u32)
    }

    /// Whether a channel is an input that takes its own pin and this edge (CCxP and CCxNP).
    fn captures(&self, channel: usize, rising: bool) -> bool {
        let own_pin = field(self.mode(channel), 0, 2) == 1;
        let polarity = field(self.ccer, channel as u32 * 4, 4) & 0b1010;
        let both = polarity == 0b1010;
        own_pin && (both || rising == (polarity == 0))
    }

    /// Whether edges on the pin of a channel are taken.
    pub(crate) fn listens(&self, channel: usize) -> bool {
        self.is_input(channel) && bit(self.ccer, channel as u32 * 4)
    }
}
