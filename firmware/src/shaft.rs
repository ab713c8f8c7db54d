//! The inputs of the encoder, as the measurement takes them.

use bsp::{Counted, Encoder, Ssi, Sums};
use node::{EncoderBoard, Parameters, RawEncoder, SsiFrame};

/// What the sampling task owns of them.
pub(crate) struct Shaft {
    encoder: Encoder,
    ssi: Ssi,
    /// Bits of the word to be read over SSI; `None` when no sensor has one.
    length: Option<u32>,
    board: EncoderBoard,
}

impl Shaft {
    pub(crate) fn new(encoder: Encoder, ssi: Ssi, board: EncoderBoard) -> Shaft {
        Shaft { encoder, ssi, length: None, board }
    }

    /// Looks which sensors there are.
    pub(crate) fn apply(&mut self, parameters: &Parameters) {
        let absolute = |channel: &node::EncoderChannel| channel.kind.is_some_and(|kind| kind.is_absolute());
        let sensors = parameters.sensors().filter(|sensors| sensors.channels.iter().any(absolute));
        self.length = sensors.map(|sensors| sensors.format.length());
    }

    /// What belongs to the millisecond of these sums. A word of SSI is that of the last millisecond, and the next one is
    /// started.
    pub(crate) fn read(&mut self, sums: &Sums) -> RawEncoder {
        let Counted { counter, index } = self.encoder.take(sums);
        let ssi = self.ssi.take().map(|word| SsiFrame { bits: word.bits, clocks: word.clocks });
        self.length.into_iter().for_each(|length| self.ssi.start(length));
        RawEncoder { counter, index, ssi, board: self.board }
    }
}
