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
    pub(crate) fn apply(&mut self, settings: PositionInputs, raw: &mut RawEncoder) {
        self.settings = settings;
        let board = if settings.are_used { self.board } else { Board::default() };
        *raw = RawEncoder { board, ..RawEncoder::default() };
    }

    /// Writes the readings for the millisecond of this count in their place. The SSI word is that of the last
    /// millisecond, and the next word is started.
    pub(crate) fn read(&mut self, counted: Counted, raw: &mut RawEncoder) {
        if !self.settings.are_used {
            return;
        }
        (raw.counter, raw.index, raw.has_gap) = (counted.counter, counted.index, counted.has_gap);
        let ssi = self.ssi.read(self.settings.ssi_bits);
        raw.ssi = ssi.map(|word| SsiFrame { bits: word.bits, clocks: word.clocks });
    }
}
