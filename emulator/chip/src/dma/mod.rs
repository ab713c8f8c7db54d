//! A DMA controller: eight streams (RM0390 section 9, RM0090 section 10).
//!
//! Modelled: direct mode between a peripheral and memory, circular and double buffer. Transfers take no time. Not
//! modelled: memory to memory, FIFO mode, bursts and flow control by the peripheral. A write that selects one of these
//! is recorded.

mod stream;

pub(crate) use stream::{Direction, Stream, Transfer};

const LISR: u32 = 0x00;
const HISR: u32 = 0x04;
const LIFCR: u32 = 0x08;
const HIFCR: u32 = 0x0C;
const FIRST_STREAM: u32 = 0x10;
const STREAM_SIZE: u32 = 0x18;

/// Positions of the flags of four streams in a status register.
const FLAG_SHIFT: [u32; 4] = [0, 6, 16, 22];

#[derive(Clone, Default)]
pub(crate) struct Dma {
    streams: [Stream; 8],
}

impl Dma {
    /// A read shows the program which streams have stopped.
    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        match offset {
            LISR => Some(self.status(0)),
            HISR => Some(self.status(4)),
            LIFCR | HIFCR => Some(0),
            _ => {
                let (index, register) = locate(offset)?;
                self.streams.get_mut(index)?.read(register)
            }
        }
    }

    /// `None` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            LISR | HISR => Some(()),
            LIFCR => self.clear(0, value),
            HIFCR => self.clear(4, value),
            _ => {
                let (index, register) = locate(offset)?;
                self.streams.get_mut(index)?.write(register, value)
            }
        }
    }

    fn status(&mut self, first: usize) -> u32 {
        let streams = self.streams[first..].iter_mut().zip(FLAG_SHIFT);
        streams.fold(0, |word, (stream, shift)| word | stream.show_flags() << shift)
    }

    fn clear(&mut self, first: usize, value: u32) -> Option<()> {
        for (stream, shift) in self.streams[first..].iter_mut().zip(FLAG_SHIFT) {
            stream.clear(value >> shift);
        }
        Some(())
    }

    /// The stream that serves a request: the first enabled stream that the request is wired to.
    pub(crate) fn serving(&mut self, request: &[Line]) -> Option<&mut Stream> {
        let line = self.line(request)?;
        self.streams.get_mut(line.stream)
    }

    /// The stream that serves a request, for reading.
    pub(crate) fn serves(&self, request: &[Line]) -> Option<&Stream> {
        self.streams.get(self.line(request)?.stream)
    }

    /// The line on which a request is served.
    pub(crate) fn line(&self, request: &[Line]) -> Option<Line> {
        request.iter().copied().find(|line| self.streams[line.stream].listens_to(line.channel))
    }

    /// The first stream for which `takes` holds.
    pub(crate) fn take(&mut self, takes: impl FnMut(&mut Stream) -> bool) -> Option<usize> {
        self.streams.iter_mut().position(takes)
    }

    /// Levels of the interrupt lines of the streams.
    pub(crate) fn interrupts(&self) -> impl Iterator<Item = bool> {
        self.streams.iter().map(Stream::interrupt)
    }
}

fn locate(offset: u32) -> Option<(usize, u32)> {
    let place = offset.checked_sub(FIRST_STREAM)?;
    Some(((place / STREAM_SIZE) as usize, place % STREAM_SIZE))
}

/// A request line: its stream, and the channel that selects the line there (RM0390 tables 28 and 29).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) stream: usize,
    pub(crate) channel: u32,
}

/// The line of a channel to a stream.
pub(crate) const fn line(stream: usize, channel: u32) -> Line {
    Line { stream, channel }
}
