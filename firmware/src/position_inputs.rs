//! The inputs of the position sensors, as the measurement takes them.

use bsp::{Counted, Ssi};
use profiles::board::{Board, PositionInputs, RawEncoder, SsiFrame};

/// What the sampling task owns of them.
pub(crate) struct PositionReader {
    ssi: Ssi,
    settings: PositionInputs,
    board: Board,
}

impl PositionReader {
    pub(crate) fn new(ssi: Ssi, board: Board) -> PositionReader {
        PositionReader { ssi, settings: PositionInputs::default(), board }
    }

    /// Reads what the parameters ask for, from the next millisecond on.
    pub(crate) fn apply(&mut self, settings: PositionInputs) {
        self.settings = settings;
    }

    /// What belongs to the millisecond of this count. A word of SSI is that of the last millisecond, and the next one is
    /// started.
    pub(crate) fn read(&mut self, counted: Counted) -> RawEncoder {
        if !self.settings.are_used {
            return RawEncoder::default();
        }
        let Counted { counter, index, has_gap } = counted;
        let ssi = self.ssi.read(self.settings.ssi_bits);
        let ssi = ssi.map(|word| SsiFrame { bits: word.bits, clocks: word.clocks });
        RawEncoder { counter, index, ssi, has_gap, board: self.board }
    }
}
