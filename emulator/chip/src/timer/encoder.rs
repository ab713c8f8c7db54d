//! Encoder mode (RM0390 section 17.3.12, RM0090 section 18.3.12): the counter follows a position.

use super::{SR_UIF, Timer};
use crate::register::{bit, field};

impl Timer {
    /// Whether inputs 1 and 2 drive the counter.
    pub(crate) fn is_encoder(&self) -> bool {
        matches!(field(self.smcr, 0, 3), 1..=3)
    }

    pub(super) fn follow(&mut self, position: Option<i64>) {
        let steps = self.steps_to(position);
        if steps == 0 || !self.counter.running() {
            return;
        }
        let forwards = steps > 0;
        let turn = self.counter.turn(steps);
        self.backwards = !forwards;
        self.match_channels(|value| turn.reached(value, forwards));
        if turn.wrapped {
            self.update_event(false);
        }
    }

    /// Counts between the last position and this one (RM0390 section 17.3.12): every edge of both inputs, or only the
    /// edges of input 2 (mode 1) or input 1 (mode 2). One inverted input reverses the direction.
    fn steps_to(&self, position: Option<i64>) -> i64 {
        let (Some(before), Some(position)) = (self.position, position) else { return 0 };
        let counted = |position: i64| match field(self.smcr, 0, 3) {
            1 => position.div_euclid(2),
            2 => (position + 1).div_euclid(2),
            _ => position,
        };
        let steps = counted(position) - counted(before);
        if bit(self.ccer, 1) == bit(self.ccer, 5) { steps } else { -steps }
    }

    /// Whether a move of the encoder from the last position raises an interrupt that is not pending yet.
    pub(crate) fn rises_at(&self, position: Option<i64>) -> bool {
        let steps = self.steps_to(position);
        let turn = self.counter.look(steps);
        let wraps = turn.wrapped && self.awaits(SR_UIF);
        wraps || self.awaited_channels().any(|channel| turn.reached(self.compare[channel].active, steps > 0))
    }

    /// Whether the encoder drives the counter and an enabled interrupt may result.
    pub(crate) fn watches_encoder(&self) -> bool {
        let watches = self.awaits(SR_UIF) || self.awaited_channels().next().is_some();
        self.is_encoder() && self.counter.running() && watches
    }
}
