//! The parts that TIM3 drives: the scans of the ADC, and the copies of the encoder's count at the start of each scan.
//!
//! Neither part may stop for good, and the two must stay in step. Both are checked once a millisecond, and both are
//! repaired in the same way: everything that TIM3 drives is set up again and restarted together ([`Event::Sampling`]).
//! The encoder's counter continues in the meantime, so no position is lost.

use stm32f4xx_hal::rcc::Rcc;

use crate::analog::sampling::{self, Sampling, Sums};
use crate::analog::step::Progress;
use crate::losses::{Event, Losses};
use crate::position::encoder::{self, Counted, Encoder};

/// Analogue inputs and the incremental encoder.
pub struct FrontEnd {
    sampling: Sampling,
    encoder: Encoder,
    losses: &'static Losses,
    /// The last call of `take` found no completed millisecond.
    is_missed: bool,
    /// The sampling was restarted after the last reading.
    has_gap: bool,
}

/// Readings of one millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// Readings of the analogue inputs.
    pub sums: Sums,
    /// Readings of the incremental encoder.
    pub counted: Counted,
}

impl FrontEnd {
    pub(crate) fn new(
        analogue: sampling::Parts,
        encoder: encoder::Parts,
        losses: &'static Losses,
        rcc: &mut Rcc,
    ) -> FrontEnd {
        let sampling = Sampling::new(analogue, losses, rcc);
        let encoder = Encoder::new(encoder, sampling.scans(), losses, rcc);
        FrontEnd { sampling, encoder, losses, is_missed: false, has_gap: false }
    }

    /// Starts the sampling. The first interrupt comes a millisecond later and must not find interrupts masked, so this
    /// is the last step of an initialisation.
    pub fn start(&mut self) {
        self.is_missed = false;
        self.sampling.start();
    }

    /// The millisecond that has just ended; `None` if none has ended. To be called at each interrupt, and also by a task
    /// that has not seen an interrupt for some milliseconds. After two calls in a row without a millisecond, everything
    /// is restarted; a single one proves nothing, because the interrupt may just have come.
    pub fn take(&mut self) -> Option<Reading> {
        let Some(sums) = self.sampling.take() else {
            if core::mem::replace(&mut self.is_missed, true) {
                self.restart();
            }
            return None;
        };
        self.is_missed = false;
        let (index, is_index_lost) = self.encoder.index();
        let counter = if self.is_in_step() {
            self.encoder.at_last_scan(sums.half)
        } else {
            // The copies belong to other scans. The present count is right, and at most one scan newer.
            self.restart();
            self.encoder.now()
        };
        let has_gap = core::mem::take(&mut self.has_gap) | sums.is_second | is_index_lost;
        Some(Reading { sums, counted: Counted { counter, index, has_gap } })
    }

    /// Whether copies and conversions are in step. If a copy comes while the three values are read, the answer is yes.
    fn is_in_step(&self) -> bool {
        let copies_left = self.encoder.copies_left();
        let conversions_left = self.sampling.conversions_left();
        let second_half = self.sampling.second_half();
        let is_certain = self.encoder.copies_left() == copies_left;
        !is_certain || Progress { conversions_left, copies_left, second_half }.is_in_step()
    }

    fn restart(&mut self) {
        self.losses.count(Event::Sampling);
        self.has_gap = true;
        self.encoder.stop_copies(self.sampling.scans());
        self.sampling.set_up_again();
        self.encoder.start_copies(self.sampling.scans());
        self.start();
    }
}
