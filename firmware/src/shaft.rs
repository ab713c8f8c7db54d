//! The inputs of the encoder, as the measurement takes them.

use bsp::{Counted, Ssi};
use node::{EncoderBoard, Parameters, RawEncoder, SsiFrame};

/// What the sampling task owns of them.
pub(crate) struct Shaft {
    ssi: Ssi,
    /// Whether the personality has sensors of positions at all.
    is_used: bool,
    /// Bits of the word to be read over SSI; `None` when no sensor has one.
    length: Option<u32>,
    board: EncoderBoard,
}

impl Shaft {
    pub(crate) fn new(ssi: Ssi, board: EncoderBoard) -> Shaft {
        Shaft { ssi, is_used: false, length: None, board }
    }

    /// Looks which sensors there are.
    pub(crate) fn apply(&mut self, parameters: &Parameters) {
        self.is_used = parameters.sensors().is_some();
        let absolute = |channel: &node::EncoderChannel| channel.kind.is_some_and(|kind| kind.is_absolute());
        let sensors = parameters.sensors().filter(|sensors| sensors.channels.iter().any(absolute));
        self.length = sensors.map(|sensors| sensors.format.length());
    }

    /// What belongs to the millisecond of this count. A word of SSI is that of the last millisecond, and the next one is
    /// started.
    pub(crate) fn read(&mut self, counted: Counted) -> RawEncoder {
        if !self.is_used {
            return RawEncoder::default();
        }
        let Counted { counter, index } = counted;
        let ssi = self.ssi.read(self.length);
        let ssi = ssi.map(|word| SsiFrame { bits: word.bits, clocks: word.clocks });
        RawEncoder { counter, index, ssi, board: self.board }
    }
}
