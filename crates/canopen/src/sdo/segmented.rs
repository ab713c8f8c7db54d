//! Segmented transfers (CiA 301, 7.2.4.3.4 and 7.2.4.3.7).

use super::objects::{BUFFER, Sink, Source};
use super::{Abort, Objects, TOGGLE};
use crate::Tick;
use crate::copy::copy;

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

    /// Sets the frame of the next segment. Returns whether the segment is the last one.
    pub(super) fn next<O: Objects>(
        &mut self,
        requested: bool,
        frame: &mut [u8; 8],
        buffer: &mut [u8; BUFFER],
        objects: &mut O,
    ) -> Result<bool, Abort> {
        if requested != self.toggle {
            return Err(Abort::Toggle);
        }
        let part;
        let content = if O::PARTS && self.source.is_in_parts() {
            part = self.source.piece(self.sent, buffer, objects)?;
            part.as_slice()
        } else {
            self.source.content(buffer, objects)?.get(self.sent..).unwrap_or(&[])
        };
        let mut next = [0; 8];
        let [command, data @ ..] = &mut next;
        let len = content.len().min(data.len());
        match content.first_chunk() {
            Some(full) => *data = *full,
            None => copy(data, content),
        }
        self.sent += len;
        self.toggle = !requested;
        let is_last = self.sent == self.source.len();
        *command = if requested { TOGGLE } else { 0 } | in_segment(7 - len) << 1 | u8::from(is_last);
        *frame = next;
        Ok(is_last)
    }
}

/// Converts a number of bytes of a segment.
#[allow(clippy::cast_possible_truncation)] // A segment has seven bytes.
const fn in_segment(bytes: usize) -> u8 {
    bytes as u8
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

    /// Takes the frame of a segment. Returns whether the transfer is over.
    pub(super) fn take(
        &mut self,
        frame: &[u8; 8],
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Tick,
    ) -> Result<bool, Abort> {
        let [command, data @ ..] = frame;
        if (command & TOGGLE != 0) != self.toggle {
            return Err(Abort::Toggle);
        }
        self.toggle = !self.toggle;
        let unused = usize::from(command >> 1 & 7);
        self.sink.append(data.get(..data.len() - unused).unwrap_or(data), buffer, objects)?;
        let is_last = command & 1 != 0;
        if is_last {
            self.sink.complete(buffer, objects, now)?;
        } else {
            self.sink.hand_over(buffer, objects)?;
        }
        Ok(is_last)
    }
}
