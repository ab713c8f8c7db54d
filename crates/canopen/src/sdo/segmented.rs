//! Segmented transfers (CiA 301, 7.2.4.3.4 and 7.2.4.3.7).

use super::objects::{BUFFER, Sink, Source};
use super::{Abort, Objects, Segment};
use crate::Instant;

/// An upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Upload {
    source: Source,
    sent: usize,
    toggle: bool,
}

impl Upload {
    pub(super) fn source(&self) -> &Source {
        &self.source
    }

    pub(super) fn new(source: Source) -> Upload {
        Upload { source, sent: 0, toggle: false }
    }

    /// The next segment. The transfer is over after a segment with `last`.
    pub(super) fn next(
        &mut self,
        requested: bool,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<Segment, Abort> {
        if requested != self.toggle {
            return Err(Abort::Toggle);
        }
        let data = self.source.piece(self.sent, buffer, objects)?;
        self.sent += usize::from(data.len());
        self.toggle = !requested;
        Ok(Segment { toggle: requested, last: self.sent == self.source.len(), data })
    }
}

/// A download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Download {
    sink: Sink,
    toggle: bool,
}

impl Download {
    pub(super) fn sink(&self) -> &Sink {
        &self.sink
    }

    pub(super) fn new(sink: Sink) -> Download {
        Download { sink, toggle: false }
    }

    /// Takes a segment. The transfer is over after a segment with `last`.
    pub(super) fn take(
        &mut self,
        segment: &Segment,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        if segment.toggle != self.toggle {
            return Err(Abort::Toggle);
        }
        self.toggle = !self.toggle;
        self.sink.append(segment.data.as_slice(), buffer, objects)?;
        if segment.last {
            self.sink.complete(buffer, objects, now)
        } else {
            self.sink.hand_over(buffer, objects)
        }
    }
}
