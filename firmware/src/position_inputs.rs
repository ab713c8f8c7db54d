//! The inputs of the position sensors, converted for the measurement.

use bsp::{Counted, Ssi};
use profiles::board::{Board, PositionInputs, RawEncoder, SsiFrame};

/// The parts of the inputs that the sampling task owns.
pub(crate) struct PositionReader {
    ssi: Ssi,
    settings: PositionInputs,
    board: Board,
}

impl PositionReader {
    pub(crate) fn new(ssi: Ssi, board: Board) -> PositionReader {
        PositionReader { ssi, settings: PositionInputs::default(), board }
    }

    /// Takes the settings; they act from the next millisecond on.
    pub(crate) fn apply(&mut self, settings: PositionInputs) {
        self.settings = settings;
    }

    /// The readings for the millisecond of this count. The SSI word is that of the last millisecond, and the next word
    /// is started.
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
